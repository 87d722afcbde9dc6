// The end of a byte on the SPI.
#pragma once

#include <avr/io.h>
#include <stdint.h>

namespace avr {

// The chip's own clock ends a byte, whatever hangs on the lines. Only a control register that was
// disturbed does not: this looks again `polls` times, 6 cycles each, and then says false. By
// reference: a byte that has ended by now, as most of a block have, costs no look at the number.
inline __attribute__((always_inline)) bool spi_ended(const uint8_t& polls) {
  if ((SPSR & _BV(SPIF)) != 0) {
    return true;
  }
  for (uint8_t left = polls; left != 0; --left) {
    if ((SPSR & _BV(SPIF)) != 0) {
      return true;
    }
  }
  return false;
}

}  // namespace avr
