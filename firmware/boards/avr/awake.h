// What ends the sleep of the main loop (hal::sleep_until_interrupt).
#pragma once

#include <avr/io.h>
#include <stdint.h>

namespace avr {

// A bit of a register that every instruction reaches: 11 000 interrupts a second look whether the
// sleep goes on. Set by those that the main loop has to look at; all others let it sleep on.
constexpr uint8_t kAwakeBit = 1;

inline void wake() {
  GPIOR0 = uint8_t(GPIOR0 | _BV(kAwakeBit));
}
inline bool awake() {
  return (GPIOR0 & _BV(kAwakeBit)) != 0;
}
inline void fall_asleep() {
  GPIOR0 = uint8_t(GPIOR0 & ~_BV(kAwakeBit));
}

}  // namespace avr
