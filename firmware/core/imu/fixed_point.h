// Fractions in 32 bits. Q30 means 1 is 2^30.
#pragma once

#include <stdint.h>

namespace core {

// a * b / 2^32, rounded.
int32_t mul_high(int32_t a, int32_t b);

// Both at most 2 in Q30.
int32_t mul_q30(int32_t a, int32_t b);

// Largest r with r * r <= value.
uint16_t square_root(uint32_t value);

// Angle of (x, y) in 0.01 deg, -18000 to 18000; 0 for (0, 0). Off by 0.016 deg at most, rounding
// included, where the larger of the two is 2^20 or more.
int16_t atan2_cdeg(int32_t y, int32_t x);

// 32767 times the sine of an angle in 0.01 deg, off by 7 at most.
int16_t sin_q15(int16_t angle_cdeg);

}  // namespace core
