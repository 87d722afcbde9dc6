// Pins of the ArduIMU V3, and what the composition root starts. Any ATmega328P at 5 V and 16 MHz
// with the sensor's data-ready line on PD2 serves too (README.md).
#pragma once

#include <stdint.h>

namespace arduimu {

constexpr uint8_t kReady = 1U << 2;   // PD2, INT0: data-ready of the MPU-6000
constexpr uint8_t kSelect = 1U << 4;  // PD4: its chip select
constexpr uint8_t kLed = 1U << 5;     // PD5, red

// Timer 1 free at 2 MHz, timer 0 ends the sleep every 1 ms.
void start_clock();

}  // namespace arduimu
