// The free-running clock of the instrument. Any context.
#pragma once

#include <stdint.h>

namespace hal {

// Microseconds since the clock was started; wraps after 71.6 min. Compare by subtraction only.
uint32_t now_us();

// The same clock in 0.5 us steps, low 16 bits: twice now_us() and its half step. Wraps after
// 32.768 ms, so a receiver frame of 22.5 ms still fits.
uint16_t now_ticks();

}  // namespace hal
