// made by hw/generate.py from hw/pin_map.toml and protocol/frames.toml; do not edit
#pragma once

#include <avr/io.h>
#include <stdint.h>

namespace pins {

// One line: its registers and its bit. Calls fold into sbi, cbi, sbis on ports A to G;
// ports H to L lie beyond those instructions and want interrupts off around a write.
struct ServoAileron {  // pin 2, aileron pulse to relay
  static constexpr uint8_t kBit = 4;
  static constexpr uint8_t kMask = uint8_t(1U << 4);
  static volatile uint8_t& port() { return PORTE; }
  static volatile uint8_t& direction() { return DDRE; }
  static volatile uint8_t& input() { return PINE; }
};
struct ServoElevator {  // pin 3, elevator pulse to relay
  static constexpr uint8_t kBit = 5;
  static constexpr uint8_t kMask = uint8_t(1U << 5);
  static volatile uint8_t& port() { return PORTE; }
  static volatile uint8_t& direction() { return DDRE; }
  static volatile uint8_t& input() { return PINE; }
};
struct ServoThrottle {  // pin 5, throttle pulse to relay
  static constexpr uint8_t kBit = 3;
  static constexpr uint8_t kMask = uint8_t(1U << 3);
  static volatile uint8_t& port() { return PORTE; }
  static volatile uint8_t& direction() { return DDRE; }
  static volatile uint8_t& input() { return PINE; }
};
struct ServoRudder {  // pin 11, rudder pulse to relay
  static constexpr uint8_t kBit = 5;
  static constexpr uint8_t kMask = uint8_t(1U << 5);
  static volatile uint8_t& port() { return PORTB; }
  static volatile uint8_t& direction() { return DDRB; }
  static volatile uint8_t& input() { return PINB; }
};
struct Rc0 {  // pin A8, receiver channel 1
  static constexpr uint8_t kBit = 0;
  static constexpr uint8_t kMask = uint8_t(1U << 0);
  static volatile uint8_t& port() { return PORTK; }
  static volatile uint8_t& direction() { return DDRK; }
  static volatile uint8_t& input() { return PINK; }
};
struct Rc1 {  // pin A9, receiver channel 2
  static constexpr uint8_t kBit = 1;
  static constexpr uint8_t kMask = uint8_t(1U << 1);
  static volatile uint8_t& port() { return PORTK; }
  static volatile uint8_t& direction() { return DDRK; }
  static volatile uint8_t& input() { return PINK; }
};
struct Rc2 {  // pin A10, receiver channel 3
  static constexpr uint8_t kBit = 2;
  static constexpr uint8_t kMask = uint8_t(1U << 2);
  static volatile uint8_t& port() { return PORTK; }
  static volatile uint8_t& direction() { return DDRK; }
  static volatile uint8_t& input() { return PINK; }
};
struct Rc3 {  // pin A11, receiver channel 4
  static constexpr uint8_t kBit = 3;
  static constexpr uint8_t kMask = uint8_t(1U << 3);
  static volatile uint8_t& port() { return PORTK; }
  static volatile uint8_t& direction() { return DDRK; }
  static volatile uint8_t& input() { return PINK; }
};
struct Rc4 {  // pin A12, receiver channel 5 (direct/Mega switch)
  static constexpr uint8_t kBit = 4;
  static constexpr uint8_t kMask = uint8_t(1U << 4);
  static volatile uint8_t& port() { return PORTK; }
  static volatile uint8_t& direction() { return DDRK; }
  static volatile uint8_t& input() { return PINK; }
};
struct ImuSda {  // pin 20, ArduIMU SDA
  static constexpr uint8_t kBit = 1;
  static constexpr uint8_t kMask = uint8_t(1U << 1);
  static volatile uint8_t& port() { return PORTD; }
  static volatile uint8_t& direction() { return DDRD; }
  static volatile uint8_t& input() { return PIND; }
};
struct ImuScl {  // pin 21, ArduIMU SCL
  static constexpr uint8_t kBit = 0;
  static constexpr uint8_t kMask = uint8_t(1U << 0);
  static volatile uint8_t& port() { return PORTD; }
  static volatile uint8_t& direction() { return DDRD; }
  static volatile uint8_t& input() { return PIND; }
};
struct BaroSda {  // pin 24, BMP085 SDA
  static constexpr uint8_t kBit = 2;
  static constexpr uint8_t kMask = uint8_t(1U << 2);
  static volatile uint8_t& port() { return PORTA; }
  static volatile uint8_t& direction() { return DDRA; }
  static volatile uint8_t& input() { return PINA; }
};
struct BaroScl {  // pin 25, BMP085 SCL
  static constexpr uint8_t kBit = 3;
  static constexpr uint8_t kMask = uint8_t(1U << 3);
  static volatile uint8_t& port() { return PORTA; }
  static volatile uint8_t& direction() { return DDRA; }
  static volatile uint8_t& input() { return PINA; }
};
struct AlphaA {  // pin A1, left angle-of-attack vane
  static constexpr uint8_t kBit = 1;
  static constexpr uint8_t kMask = uint8_t(1U << 1);
  static volatile uint8_t& port() { return PORTF; }
  static volatile uint8_t& direction() { return DDRF; }
  static volatile uint8_t& input() { return PINF; }
};
struct BetaA {  // pin A2, left sideslip vane
  static constexpr uint8_t kBit = 2;
  static constexpr uint8_t kMask = uint8_t(1U << 2);
  static volatile uint8_t& port() { return PORTF; }
  static volatile uint8_t& direction() { return DDRF; }
  static volatile uint8_t& input() { return PINF; }
};
struct DpA {  // pin A3, left pitot MPXV7002DP
  static constexpr uint8_t kBit = 3;
  static constexpr uint8_t kMask = uint8_t(1U << 3);
  static volatile uint8_t& port() { return PORTF; }
  static volatile uint8_t& direction() { return DDRF; }
  static volatile uint8_t& input() { return PINF; }
};
struct DpB {  // pin A4, right pitot MPXV7002DP
  static constexpr uint8_t kBit = 4;
  static constexpr uint8_t kMask = uint8_t(1U << 4);
  static volatile uint8_t& port() { return PORTF; }
  static volatile uint8_t& direction() { return DDRF; }
  static volatile uint8_t& input() { return PINF; }
};
struct AlphaB {  // pin A5, right angle-of-attack vane
  static constexpr uint8_t kBit = 5;
  static constexpr uint8_t kMask = uint8_t(1U << 5);
  static volatile uint8_t& port() { return PORTF; }
  static volatile uint8_t& direction() { return DDRF; }
  static volatile uint8_t& input() { return PINF; }
};
struct BetaB {  // pin A6, right sideslip vane
  static constexpr uint8_t kBit = 6;
  static constexpr uint8_t kMask = uint8_t(1U << 6);
  static volatile uint8_t& port() { return PORTF; }
  static volatile uint8_t& direction() { return DDRF; }
  static volatile uint8_t& input() { return PINF; }
};
struct PotElevator {  // pin A7, elevator potentiometer
  static constexpr uint8_t kBit = 7;
  static constexpr uint8_t kMask = uint8_t(1U << 7);
  static volatile uint8_t& port() { return PORTF; }
  static volatile uint8_t& direction() { return DDRF; }
  static volatile uint8_t& input() { return PINF; }
};
struct PotAileronLeft {  // pin A13, left aileron potentiometer
  static constexpr uint8_t kBit = 5;
  static constexpr uint8_t kMask = uint8_t(1U << 5);
  static volatile uint8_t& port() { return PORTK; }
  static volatile uint8_t& direction() { return DDRK; }
  static volatile uint8_t& input() { return PINK; }
};
struct PotAileronRight {  // pin A0, right aileron potentiometer
  static constexpr uint8_t kBit = 0;
  static constexpr uint8_t kMask = uint8_t(1U << 0);
  static volatile uint8_t& port() { return PORTF; }
  static volatile uint8_t& direction() { return DDRF; }
  static volatile uint8_t& input() { return PINF; }
};
struct PotRudder {  // pin A14, rudder potentiometer
  static constexpr uint8_t kBit = 6;
  static constexpr uint8_t kMask = uint8_t(1U << 6);
  static volatile uint8_t& port() { return PORTK; }
  static volatile uint8_t& direction() { return DDRK; }
  static volatile uint8_t& input() { return PINK; }
};
struct Rail {  // pin A15, servo rail through 10 k / 10 k
  static constexpr uint8_t kBit = 7;
  static constexpr uint8_t kMask = uint8_t(1U << 7);
  static volatile uint8_t& port() { return PORTK; }
  static volatile uint8_t& direction() { return DDRK; }
  static volatile uint8_t& input() { return PINK; }
};
struct CardMiso {  // pin 50, SD DO
  static constexpr uint8_t kBit = 3;
  static constexpr uint8_t kMask = uint8_t(1U << 3);
  static volatile uint8_t& port() { return PORTB; }
  static volatile uint8_t& direction() { return DDRB; }
  static volatile uint8_t& input() { return PINB; }
};
struct CardMosi {  // pin 51, SD DI through level shifter
  static constexpr uint8_t kBit = 2;
  static constexpr uint8_t kMask = uint8_t(1U << 2);
  static volatile uint8_t& port() { return PORTB; }
  static volatile uint8_t& direction() { return DDRB; }
  static volatile uint8_t& input() { return PINB; }
};
struct CardSck {  // pin 52, SD CLK through level shifter
  static constexpr uint8_t kBit = 1;
  static constexpr uint8_t kMask = uint8_t(1U << 1);
  static volatile uint8_t& port() { return PORTB; }
  static volatile uint8_t& direction() { return DDRB; }
  static volatile uint8_t& input() { return PINB; }
};
struct CardCs {  // pin 53, SD CS through level shifter
  static constexpr uint8_t kBit = 0;
  static constexpr uint8_t kMask = uint8_t(1U << 0);
  static volatile uint8_t& port() { return PORTB; }
  static volatile uint8_t& direction() { return DDRB; }
  static volatile uint8_t& input() { return PINB; }
};
struct UsbRx {  // pin 0, USB
  static constexpr uint8_t kBit = 0;
  static constexpr uint8_t kMask = uint8_t(1U << 0);
  static volatile uint8_t& port() { return PORTE; }
  static volatile uint8_t& direction() { return DDRE; }
  static volatile uint8_t& input() { return PINE; }
};
struct UsbTx {  // pin 1, USB
  static constexpr uint8_t kBit = 1;
  static constexpr uint8_t kMask = uint8_t(1U << 1);
  static volatile uint8_t& port() { return PORTE; }
  static volatile uint8_t& direction() { return DDRE; }
  static volatile uint8_t& input() { return PINE; }
};
struct GpsTx {  // pin 16, GPS RX
  static constexpr uint8_t kBit = 1;
  static constexpr uint8_t kMask = uint8_t(1U << 1);
  static volatile uint8_t& port() { return PORTH; }
  static volatile uint8_t& direction() { return DDRH; }
  static volatile uint8_t& input() { return PINH; }
};
struct GpsRx {  // pin 17, GPS TX
  static constexpr uint8_t kBit = 0;
  static constexpr uint8_t kMask = uint8_t(1U << 0);
  static volatile uint8_t& port() { return PORTH; }
  static volatile uint8_t& direction() { return DDRH; }
  static volatile uint8_t& input() { return PINH; }
};
struct TelemetryTx {  // pin 14, radio DIN
  static constexpr uint8_t kBit = 1;
  static constexpr uint8_t kMask = uint8_t(1U << 1);
  static volatile uint8_t& port() { return PORTJ; }
  static volatile uint8_t& direction() { return DDRJ; }
  static volatile uint8_t& input() { return PINJ; }
};
struct TelemetryRx {  // pin 15, radio DOUT
  static constexpr uint8_t kBit = 0;
  static constexpr uint8_t kMask = uint8_t(1U << 0);
  static volatile uint8_t& port() { return PORTJ; }
  static volatile uint8_t& direction() { return DDRJ; }
  static volatile uint8_t& input() { return PINJ; }
};
struct Heartbeat {  // pin 8, charge pump of the relay
  static constexpr uint8_t kBit = 5;
  static constexpr uint8_t kMask = uint8_t(1U << 5);
  static volatile uint8_t& port() { return PORTH; }
  static volatile uint8_t& direction() { return DDRH; }
  static volatile uint8_t& input() { return PINH; }
};
struct RelaySense {  // pin 9, sense contacts of the relay
  static constexpr uint8_t kBit = 6;
  static constexpr uint8_t kMask = uint8_t(1U << 6);
  static volatile uint8_t& port() { return PORTH; }
  static volatile uint8_t& direction() { return DDRH; }
  static volatile uint8_t& input() { return PINH; }
};
struct Buzzer {  // pin 7, buzzer
  static constexpr uint8_t kBit = 4;
  static constexpr uint8_t kMask = uint8_t(1U << 4);
  static volatile uint8_t& port() { return PORTH; }
  static volatile uint8_t& direction() { return DDRH; }
  static volatile uint8_t& input() { return PINH; }
};
struct Led {  // pin 6, status LED through 330 ohm
  static constexpr uint8_t kBit = 3;
  static constexpr uint8_t kMask = uint8_t(1U << 3);
  static volatile uint8_t& port() { return PORTH; }
  static volatile uint8_t& direction() { return DDRH; }
  static volatile uint8_t& input() { return PINH; }
};
struct Button {  // pin 41, start/stop button to ground
  static constexpr uint8_t kBit = 0;
  static constexpr uint8_t kMask = uint8_t(1U << 0);
  static volatile uint8_t& port() { return PORTG; }
  static volatile uint8_t& direction() { return DDRG; }
  static volatile uint8_t& input() { return PING; }
};

// ADC channel of each slot of the scan: as in the identification frame, the rail last.
constexpr uint8_t kAnalogSlots = 11;
constexpr uint8_t kAnalogRounds = 4;
constexpr uint8_t kAnalogChannel[kAnalogSlots] = {1, 5, 2, 6, 3, 4, 7, 13, 0, 14, 15};

}  // namespace pins
