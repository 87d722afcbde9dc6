#include "core/fixed_point.h"

namespace core {
namespace {

constexpr int16_t kQuarter = 9000;
constexpr int16_t kHalf = 18000;

uint32_t magnitude(int32_t value) {
  return value < 0 ? 0U - static_cast<uint32_t>(value) : static_cast<uint32_t>(value);
}

// arctan(z) in quarters of 0.01 deg for z = 0 to 1 in Q16: odd polynomial of degree 11, minimax fit
// by iterated least squares, off by 1e-4 deg.
int32_t arctan_quarters(uint16_t z_q16) {
  constexpr int32_t kTerms[] = {-269, 1207, -2668, 4436, -7623, 22918};
  const int32_t square = static_cast<int32_t>((static_cast<uint32_t>(z_q16) * z_q16) >> 17);  // Q15
  int32_t sum = 0;
  for (const int32_t term : kTerms) {
    sum = term + sum * square / 32768;
  }
  return static_cast<int32_t>((static_cast<uint32_t>(sum) * z_q16) >> 16);
}

}  // namespace

uint16_t square_root(uint32_t value) {
  uint32_t root = 0;
  for (uint32_t bit = UINT32_C(1) << 30; bit != 0; bit >>= 2) {
    const uint32_t trial = root + bit;
    root >>= 1;
    if (value >= trial) {
      value -= trial;
      root += bit;
    }
  }
  return static_cast<uint16_t>(root);
}

int16_t atan2_cdeg(int32_t y, int32_t x) {
  uint32_t ay = magnitude(y);
  uint32_t ax = magnitude(x);
  if (ax == 0 && ay == 0) {
    return 0;
  }
  while (((ax | ay) & 0xFFFF0000UL) != 0) {  // at most 16 bits for the division
    ax >>= 1;
    ay >>= 1;
  }
  const bool steep = ay > ax;
  const uint32_t large = steep ? ay : ax;
  const uint32_t small = steep ? ax : ay;
  const uint32_t ratio = (small << 16) / large;
  const uint16_t z_q16 = ratio > 0xFFFF ? uint16_t{0xFFFF} : static_cast<uint16_t>(ratio);
  int32_t angle = (arctan_quarters(z_q16) + 2) / 4;
  angle = steep ? kQuarter - angle : angle;
  angle = x < 0 ? kHalf - angle : angle;
  return static_cast<int16_t>(y < 0 ? -angle : angle);
}

int16_t sin_q15(int16_t angle_cdeg) {
  const bool negative = angle_cdeg < 0;
  int32_t angle = negative ? -int32_t{angle_cdeg} : int32_t{angle_cdeg};
  angle %= 36000;
  const bool second = angle > kHalf;
  angle = second ? angle - kHalf : angle;
  angle = angle > kQuarter ? kHalf - angle : angle;
  // sin(pi/2 u) = u (1.57071 - 0.64323 u^2 + 0.07271 u^4) on 0 to 1 (fit, off by 1e-4), u in Q15.
  const int32_t u = angle * 32768 / kQuarter;
  const int32_t square = u * u / 32768;
  const int32_t sum = 51469 + square * (-21077 + square * 2383 / 32768) / 32768;
  int32_t value = (u >> 1) * (sum >> 1) / 8192;
  value = value > 32767 ? 32767 : value;
  return static_cast<int16_t>(negative != second ? -value : value);
}

int16_t cos_q15(int16_t angle_cdeg) {
  const int16_t size =
      static_cast<int16_t>(angle_cdeg < 0 ? -int32_t{angle_cdeg} : int32_t{angle_cdeg});
  return sin_q15(static_cast<int16_t>(kQuarter - size));
}

}  // namespace core
