#include "core/imu/original_packets.h"

#include <string.h>

#include "core/bytes.h"
#include "core/imu/fixed_point.h"

namespace core {
namespace {

constexpr int32_t kRatePerLsb = 16409;       // 16.4 / 65.5 in Q16
constexpr int32_t kDegPerCdeg = 83886;       // 0.01 in Q23
constexpr int32_t kDegPer1e7 = 1801439851;   // 1e-7 * 2^22 * 2^32
constexpr int32_t kMetrePerMm = 1099511628;  // 1e-3 * 2^8 * 2^32
constexpr int32_t kPerHundred = 41943;       // 0.01 in Q22

void put(uint8_t* out, uint8_t index, int32_t value, uint8_t fraction_bits) {
  put_le(out + 4 * index, float32_bits(value, fraction_bits));
}

}  // namespace

uint32_t float32_bits(int32_t value, uint8_t fraction_bits) {
  if (value == 0) {
    return 0;
  }
  const bool negative = value < 0;
  uint32_t size = negative ? 0U - static_cast<uint32_t>(value) : static_cast<uint32_t>(value);
  uint8_t exponent = static_cast<uint8_t>(127 + 23 - fraction_bits);
  while (size >= UINT32_C(1) << 24) {
    size >>= 1;
    ++exponent;
  }
  while (size < UINT32_C(1) << 23) {
    size <<= 1;
    --exponent;
  }
  return (negative ? 0x80000000UL : 0UL) | static_cast<uint32_t>(exponent) << 23 |
         (size & 0x7FFFFFUL);
}

void put_original_first(uint8_t* out, const OriginalValues& values) {
  for (uint8_t axis = 0; axis < 3; ++axis) {
    put(out, axis, values.angles[axis] * kDegPerCdeg, 23);
    put(out, static_cast<uint8_t>(3 + axis), values.rates[axis] * kRatePerLsb, 16);
  }
  put(out, 6, -int32_t{values.force[0]}, 0);
  put(out, 7, -int32_t{values.force[1]}, 0);
}

void put_original_second(uint8_t* out, const OriginalValues& values, const frames::GpsFrame& gps) {
  memset(out, 0, frames::kOriginalImu2PacketSize);
  put(out, 0, -int32_t{values.force[2]}, 0);
  if (gps.fix != static_cast<uint8_t>(frames::GpsFix::kFix3d)) {
    return;
  }
  put(out, 1, mul_high(gps.latitude, kDegPer1e7), 22);
  put(out, 2, mul_high(gps.longitude, kDegPer1e7), 22);
  put(out, 3, mul_high(gps.height, kMetrePerMm), 8);
  if (gps.course <= 36000) {
    put(out, 4, int32_t{gps.course} * kPerHundred, 22);
  }
  if (gps.ground_speed < 50000) {
    put(out, 5, int32_t{gps.ground_speed} * kPerHundred, 22);
  }
  put(out, 6, 1, 0);
  put(out, 7, gps.satellites, 0);
}

}  // namespace core
