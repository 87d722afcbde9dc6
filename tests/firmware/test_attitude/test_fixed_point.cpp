// The fixed-point functions over all that they take, against floating point.
#ifndef __AVR__

#include <math.h>
#include <stdlib.h>

#include "check.h"
#include "core/imu/fixed_point.h"

namespace {

constexpr double kCdegPerRad = 18000.0 / 3.14159265358979323846;

}  // namespace

TEST_CASE("arctan over its octant: 0.015 deg at most, and the mean that its truncations leave") {
  // Of each eighth of z, in 0.01 deg: rounding up leaves a fifth, the truncated terms the rest. A
  // coefficient that is off by one moves one of them by 0.02.
  const double means[] = {0.212, 0.241, 0.275, 0.290, 0.316, 0.364, 0.425, 0.531};
  for (int eighth = 0; eighth < 8; ++eighth) {
    double sum = 0.0;
    for (int z = 1; z <= 8192; ++z) {
      const int32_t y = (eighth * 8192 + z) * 128;
      const double off =
          core::atan2_cdeg(y, 65536 * 128) - atan2(double(y), 65536.0 * 128.0) * kCdegPerRad;
      sum += off;
      CHECK(fabs(off) < 1.5);
    }
    CHECK(fabs(sum / 8192.0 - means[eighth]) < 0.008);
  }
}

TEST_CASE("arctan in all octants is the first one's, at every size of its arguments") {
  const int32_t size = INT32_C(1) << 20;
  for (int32_t y = 0; y <= size; y += 1021) {
    const int16_t angle = core::atan2_cdeg(y, size);
    CHECK_EQ(core::atan2_cdeg(size, y), 9000 - angle);
    CHECK_EQ(core::atan2_cdeg(y, -size), 18000 - angle);
    CHECK_EQ(core::atan2_cdeg(-y, size), -angle);
    if (y != 0) {
      CHECK_EQ(core::atan2_cdeg(size, -y), 9000 + angle);
      CHECK_EQ(core::atan2_cdeg(-y, -size), angle - 18000);
      CHECK_EQ(core::atan2_cdeg(-size, -y), -9000 - angle);
    }
    CHECK_EQ(core::atan2_cdeg(-size, y), angle - 9000);
    for (int up = 0; up <= 10; ++up) {
      const int16_t same = core::atan2_cdeg(y * (1 << up), size * (1 << up));
      CHECK(abs(same - angle) <= 1);
    }
  }
  CHECK_EQ(core::atan2_cdeg(1, 0), core::atan2_cdeg(1 << 30, 0));
  CHECK_EQ(core::atan2_cdeg(1, 1), core::atan2_cdeg(1 << 30, 1 << 30));
  CHECK_EQ(core::atan2_cdeg(0, 1), 0);
  CHECK_EQ(core::atan2_cdeg(0, -1), 18000);
  CHECK_EQ(core::atan2_cdeg(INT32_MIN, 0), -9000);
  CHECK_EQ(core::atan2_cdeg(0, INT32_MIN), 18000);
}

TEST_CASE("the sine of every angle there is: 7 counts at most, odd, and round in 360 deg") {
  double sum = 0.0;
  for (int32_t angle = 0; angle <= 32767; ++angle) {
    const int16_t sine = core::sin_q15(static_cast<int16_t>(angle));
    const double off = sine - 32767.0 * sin(angle / kCdegPerRad);
    CHECK(fabs(off) < 7.0);
    CHECK_EQ(core::sin_q15(static_cast<int16_t>(-angle)), -sine);
    sum += angle <= 9000 ? off : 0.0;
  }
  CHECK(fabs(sum / 9001.0 - 0.58) < 0.03);  // what truncations leave of the fit
  CHECK_EQ(core::sin_q15(9000), 32767);
  CHECK_EQ(core::sin_q15(27000), -32767);
  CHECK_EQ(core::sin_q15(18000), 0);
  CHECK(abs(core::sin_q15(INT16_MIN) - core::sin_q15(3232)) <= 1);
}

TEST_CASE("the root of every square, and of one less") {
  for (uint32_t root = 1; root <= 0xFFFF; ++root) {
    CHECK_EQ(core::square_root(root * root), root);
    CHECK_EQ(core::square_root(root * root - 1), root - 1);
  }
}

#endif
