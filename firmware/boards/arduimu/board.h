// Pins of the ArduIMU V3, and what its files offer each other. Any ATmega328P at 5 V and 16 MHz
// with the sensor's data-ready line on PD2 serves too (README.md).
#pragma once

#include <stdint.h>

namespace arduimu {

constexpr uint8_t kReady = 1U << 2;   // PD2, INT0: data-ready of the MPU-6000
constexpr uint8_t kSelect = 1U << 4;  // PD4: its chip select
constexpr uint8_t kLed = 1U << 5;     // PD5, red: lit while samples are made

// Timer 1 free at 2 MHz, timer 0 ends the sleep every 1 ms. Wraps after 71.6 min.
void start_clock();
uint32_t now_us();

// Data-ready: true once per edge, with the instant of the last and how many there were.
void start_ready();
bool take_ready(uint32_t& at_us, uint8_t& edges);

// Ends the sleep at an instant at most 32 ms away, once.
void wake_at(uint32_t at_us);

// Restarts the program after 0.5 s without hal::feed_watchdog(); the count outlives it.
void start_watchdog();
uint16_t resets();

}  // namespace arduimu
