#include "core/imu/fixed_point.h"

namespace core {
namespace {

constexpr int16_t kQuarter = 9000;
constexpr int16_t kHalf = 18000;

uint32_t magnitude(int32_t value) {
  return value < 0 ? 0U - static_cast<uint32_t>(value) : static_cast<uint32_t>(value);
}

// Not inlined: only alone does avr-gcc 5.4 see that 16 bits suffice.
__attribute__((noinline)) uint32_t mul_16(uint16_t a, uint16_t b) {
  return static_cast<uint32_t>(a) * b;
}

// arctan(z) in quarters of 0.01 deg for z = 0 to 1 in Q16: odd polynomial of degree 11, minimax fit
// by iterated least squares, off by 1e-4 deg. Its signs alternate and no partial sum is negative.
uint16_t arctan_quarters(uint16_t z_q16) {
  constexpr uint16_t kTerms[] = {1207, 2668, 4436, 7623, 22918};
  const uint16_t square = static_cast<uint16_t>(mul_16(z_q16, z_q16) >> 16);
  uint16_t sum = 269;
  for (const uint16_t term : kTerms) {
    sum = static_cast<uint16_t>(term - static_cast<uint16_t>(mul_16(sum, square) >> 16));
  }
  return static_cast<uint16_t>(mul_16(sum, z_q16) >> 16);
}

}  // namespace

// (a * b + 2^31) / 2^32 of unsigned numbers.
inline uint32_t mul_high_unsigned(uint32_t a, uint32_t b) {
#ifdef __AVR__
  // Column by column, three bytes of sum moving up: 215 cycles with the call. From C++ avr-gcc 5.4
  // makes 600 of int64_t and 400 of four products of 16 bits, most of them for its stack frame.
  uint32_t high;
  uint8_t x, y, z, zero;
  __asm__(
      "clr %[zero] \n\tclr %[y] \n\tclr %[z] \n\tmul %A[a], %A[b] \n\tmov %[x], r1 \n\t"
      "mul %A[a], %B[b] \n\tadd %[x], r0 \n\tadc %[y], r1 \n\tadc %[z], %[zero] \n\t"
      "mul %B[a], %A[b] \n\tadd %[x], r0 \n\tadc %[y], r1 \n\tadc %[z], %[zero] \n\t"
      "clr %[x] \n\t"
      "mul %A[a], %C[b] \n\tadd %[y], r0 \n\tadc %[z], r1 \n\tadc %[x], %[zero] \n\t"
      "mul %B[a], %B[b] \n\tadd %[y], r0 \n\tadc %[z], r1 \n\tadc %[x], %[zero] \n\t"
      "mul %C[a], %A[b] \n\tadd %[y], r0 \n\tadc %[z], r1 \n\tadc %[x], %[zero] \n\t"
      "clr %[y] \n\t"
      "mul %A[a], %D[b] \n\tadd %[z], r0 \n\tadc %[x], r1 \n\tadc %[y], %[zero] \n\t"
      "mul %B[a], %C[b] \n\tadd %[z], r0 \n\tadc %[x], r1 \n\tadc %[y], %[zero] \n\t"
      "mul %C[a], %B[b] \n\tadd %[z], r0 \n\tadc %[x], r1 \n\tadc %[y], %[zero] \n\t"
      "mul %D[a], %A[b] \n\tadd %[z], r0 \n\tadc %[x], r1 \n\tadc %[y], %[zero] \n\t"
      "lsl %[z] \n\tadc %[x], %[zero] \n\tadc %[y], %[zero] \n\tclr %[z] \n\t"  // rounds
      "mul %B[a], %D[b] \n\tadd %[x], r0 \n\tadc %[y], r1 \n\tadc %[z], %[zero] \n\t"
      "mul %C[a], %C[b] \n\tadd %[x], r0 \n\tadc %[y], r1 \n\tadc %[z], %[zero] \n\t"
      "mul %D[a], %B[b] \n\tadd %[x], r0 \n\tadc %[y], r1 \n\tadc %[z], %[zero] \n\t"
      "mov %A[high], %[x] \n\tclr %[x] \n\t"
      "mul %C[a], %D[b] \n\tadd %[y], r0 \n\tadc %[z], r1 \n\tadc %[x], %[zero] \n\t"
      "mul %D[a], %C[b] \n\tadd %[y], r0 \n\tadc %[z], r1 \n\tadc %[x], %[zero] \n\t"
      "mov %B[high], %[y] \n\tmul %D[a], %D[b] \n\tadd %[z], r0 \n\tadc %[x], r1 \n\t"
      "mov %C[high], %[z] \n\tmov %D[high], %[x] \n\tclr r1 \n\t"
      : [high] "=&r"(high), [x] "=&r"(x), [y] "=&r"(y), [z] "=&r"(z), [zero] "=&r"(zero)
      : [a] "r"(a), [b] "r"(b)
      : "r0");
  return high;
#else
  return static_cast<uint32_t>((static_cast<uint64_t>(a) * b + 0x80000000U) >> 32);
#endif
}

// Not inlined: the filter calls it a hundred times.
__attribute__((noinline)) int32_t mul_high(int32_t a, int32_t b) {
  uint32_t high = mul_high_unsigned(static_cast<uint32_t>(a), static_cast<uint32_t>(b));
  // As unsigned, a negative factor counted 2^32 too much.
  high -= a < 0 ? static_cast<uint32_t>(b) : 0U;
  high -= b < 0 ? static_cast<uint32_t>(a) : 0U;
  return static_cast<int32_t>(high);
}

__attribute__((noinline)) int32_t mul_q30(int32_t a, int32_t b) {
  return static_cast<int32_t>(static_cast<uint32_t>(mul_high(a, b)) << 2);
}

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
  // At most 16 bits for the division; eight at once are a move of bytes.
  while (((ax | ay) & 0xFF000000UL) != 0) {
    ax >>= 8;
    ay >>= 8;
  }
  while (((ax | ay) & 0xFFFF0000UL) != 0) {
    ax >>= 1;
    ay >>= 1;
  }
  const bool steep = ay > ax;
  const uint32_t large = steep ? ay : ax;
  const uint32_t small = steep ? ax : ay;
  const uint32_t ratio = (small << 16) / large;
  const uint16_t z_q16 = ratio > 0xFFFF ? uint16_t{0xFFFF} : static_cast<uint16_t>(ratio);
  int32_t angle = (arctan_quarters(z_q16) + 3U) >> 2;
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

}  // namespace core
