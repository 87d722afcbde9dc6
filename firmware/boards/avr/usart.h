// The rate of a USART.
#pragma once

#include <stdint.h>

namespace avr {

// UBRR for double speed, rounded to the nearest rate; 111111 and 250000 come out exactly.
inline uint16_t usart_divider(const uint32_t baud) {
  return uint16_t((F_CPU / 4 / baud - 1) / 2);
}

}  // namespace avr
