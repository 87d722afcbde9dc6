// The free-running clock of the instrument. Any context.
#pragma once

#include <stdint.h>

namespace hal {

// Microseconds since the clock was started; wraps after 71.6 min. Compare by subtraction only.
uint32_t now_us();

// The same clock in 0.5 us steps; wraps after 35.8 min.
uint32_t now_ticks();

}  // namespace hal
