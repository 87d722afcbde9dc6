// The shapes against their formulas in floating point, and bounds for any good row.
#include <math.h>

#include "check.h"
#include "core/test_input.h"
#include "random_numbers.h"

namespace {

using core::CardRow;
using frames::CardShape;

constexpr double kTurn = 2 * 3.14159265358979;

CardRow row_of(CardShape shape, uint16_t duration_ms, int16_t amplitude_us) {
  CardRow row = {};
  row.shape = static_cast<uint8_t>(shape);
  row.axes = 2;
  row.duration_ms = duration_ms;
  row.amplitude_us[1] = amplitude_us;
  return row;
}

int16_t of_axis(const CardRow& row, uint8_t axis, uint16_t t_ms) {
  int16_t ticks[core::kCardAxes];
  core::deflect(row, core::turns_per_ms(row), t_ms, ticks);
  return ticks[axis];
}

int16_t at(const CardRow& row, uint16_t t_ms) {
  return of_axis(row, 1, t_ms);
}

bool near(double a, double b, double within) {
  return fabs(a - b) <= within;
}

}  // namespace

TEST_CASE("the sine is within 3 of 16384 everywhere, and odd") {
  for (uint32_t phase = 0; phase < 65536UL; phase += 7) {
    const double exact = 16384.0 * sin(kTurn * static_cast<double>(phase) / 65536.0);
    CHECK(near(core::sin14(static_cast<uint16_t>(phase)), exact, 3.0));
    CHECK_EQ(core::sin14(static_cast<uint16_t>(phase)),
             -core::sin14(static_cast<uint16_t>(phase + 32768U)));
  }
  CHECK_EQ(core::sin14(0), 0);
  CHECK_EQ(core::sin14(16384), 16384);
  CHECK_EQ(core::sin14(32768U), 0);
  CHECK_EQ(core::sin14(49152U), -16384);
}

TEST_CASE("each value of the table is the nearest, as the page says") {
  for (uint16_t i = 0; i <= 64; ++i) {
    const double exact = 16384.0 * sin(kTurn * i / 256.0);
    CHECK(near(core::sin14(static_cast<uint16_t>(i << 8)), exact, 0.5));
  }
}

TEST_CASE("a pulse stands for its time and no longer") {
  const CardRow row = row_of(CardShape::kPulse, 500, -70);
  CHECK_EQ(at(row, 0), -140);
  CHECK_EQ(at(row, 499), -140);
  CHECK_EQ(at(row, 500), 0);
  CHECK_EQ(at(row, 65535U), 0);
  CHECK_EQ(of_axis(row, 0, 10), 0);
  CHECK_EQ(of_axis(row, 2, 10), 0);
}

TEST_CASE("a doublet turns in its middle, of an odd length too") {
  const CardRow row = row_of(CardShape::kDoublet, 1001, 100);
  CHECK_EQ(at(row, 0), 200);
  CHECK_EQ(at(row, 500), 200);
  CHECK_EQ(at(row, 501), -200);
  CHECK_EQ(at(row, 1000), -200);
  CHECK_EQ(at(row, 1001), 0);
}

TEST_CASE("a doublet of an even length turns at its half, on every axis") {
  CardRow row = row_of(CardShape::kDoublet, 1000, 100);
  row.amplitude_us[0] = 30;
  row.amplitude_us[2] = -40;
  CHECK_EQ(at(row, 499), 200);
  CHECK_EQ(at(row, 500), -200);
  CHECK_EQ(of_axis(row, 0, 500), -60);
  CHECK_EQ(of_axis(row, 2, 500), 80);
}

TEST_CASE("3-2-1-1 has its four parts") {
  const CardRow row = row_of(CardShape::kThreeTwoOneOne, 7000, 50);
  const uint16_t edges[] = {0, 3000, 5000, 6000, 7000};
  const int16_t parts[] = {100, -100, 100, -100, 0};
  for (uint8_t i = 0; i < 5; ++i) {
    CHECK_EQ(at(row, edges[i]), parts[i]);
    if (i > 0) CHECK_EQ(at(row, static_cast<uint16_t>(edges[i] - 1U)), parts[i - 1]);
  }
  const CardRow longest = row_of(CardShape::kThreeTwoOneOne, 20000, 50);
  CHECK_EQ(at(longest, 19999), -100);
}

TEST_CASE("a sweep is the sine of its integral, up and down") {
  for (uint8_t down = 0; down < 2; ++down) {
    CardRow row = row_of(CardShape::kSweep, 20000, 500);
    row.first_chz = down != 0 ? 500 : 10;
    row.last_chz = down != 0 ? 10 : 500;
    for (uint16_t t = 0; t < 20000; t = static_cast<uint16_t>(t + 13)) {
      const double s = t / 1000.0;
      const double turns =
          row.first_chz / 100.0 * s +
          (double(row.last_chz) - double(row.first_chz)) / 100.0 * s * s / (2.0 * 20.0);
      // 1/16 ms of 5 Hz, and the sine's own: 0.3 %.
      CHECK(near(at(row, t), 1000.0 * sin(kTurn * fmod(turns, 1.0)), 4.0));
    }
  }
}

TEST_CASE("a multisine is the sum of its sines, each axis its own") {
  CardRow row = row_of(CardShape::kMultisine, 10000, 300);
  row.axes = 3;
  row.amplitude_us[0] = -120;
  const uint8_t components[] = {2, 10, 64 + 20, 7, 200, 64 + 33, 50, 77, 64 + 5, 3, 128, 50};
  for (uint8_t i = 0; i < sizeof components; ++i) row.components[i] = components[i];
  for (uint16_t t = 0; t < 10000; t = static_cast<uint16_t>(t + 7)) {
    double sum[2] = {};
    for (uint8_t i = 0; i < sizeof components; i = static_cast<uint8_t>(i + 3)) {
      const double turns = components[i] * (t / 10000.0) + components[i + 1] / 256.0;
      sum[components[i + 2] >> 6] +=
          (components[i + 2] & 63) / 64.0 * sin(kTurn * fmod(turns, 1.0));
    }
    CHECK(near(of_axis(row, 1, t), 600.0 * sum[1], 2.0));
    CHECK(near(of_axis(row, 0, t), -240.0 * sum[0], 2.0));
    CHECK_EQ(of_axis(row, 2, t), 0);
  }
}

TEST_CASE("a sweep moves every axis of its row") {
  CardRow row = row_of(CardShape::kSweep, 4000, 100);
  row.amplitude_us[0] = 100;
  row.amplitude_us[2] = -100;
  row.first_chz = row.last_chz = 50;
  CHECK(at(row, 500) >= 199);  // a quarter of its turn
  for (uint16_t t_ms = 0; t_ms < 4000; t_ms = static_cast<uint16_t>(t_ms + 250)) {
    CHECK_EQ(of_axis(row, 0, t_ms), at(row, t_ms));
    CHECK_EQ(of_axis(row, 2, t_ms), -at(row, t_ms));
  }
}

TEST_CASE("a multisine is, to the tick, what the page writes in whole numbers") {
  Random random(4712);
  for (uint16_t n = 0; n < 120; ++n) {
    CardRow row = row_of(CardShape::kMultisine,
                         static_cast<uint16_t>(100 + random.below(19901)),
                         static_cast<int16_t>(random.below(1001) - 500));
    const uint8_t used = static_cast<uint8_t>(1 + random.below(4));
    for (uint8_t i = 0; i < used; ++i) {
      row.components[3 * i] = static_cast<uint8_t>(n % 3 == 0 ? 1 : 1 + random.below(100));
      row.components[3 * i + 1] = random.byte();
      row.components[3 * i + 2] = static_cast<uint8_t>(1 << 6 | random.below(64));
    }
    row.components[3 * used + 1] = 100;
    row.components[3 * used + 2] = 1 << 6 | 63;  // behind the last: no harmonic, no sine
    const uint64_t a_ms = 4294967295ULL / row.duration_ms;
    for (uint8_t k = 0; k < 20; ++k) {
      const uint16_t t_ms = random.below(row.duration_ms);
      int64_t sum = 0;
      for (uint8_t i = 0; i < used; ++i) {
        const uint64_t turn = row.components[3 * i] * (t_ms * a_ms) +
                              (static_cast<uint64_t>(row.components[3 * i + 1]) << 24);
        const uint16_t phase = static_cast<uint16_t>((turn & 0xFFFFFFFFU) >> 16);
        sum += int64_t{core::sin14(phase)} * (row.components[3 * i + 2] & 63);
      }
      const int64_t most = 2 * int64_t{row.amplitude_us[1]};
      int64_t wanted = sum / 16 * most / 65536;
      const int64_t size = most < 0 ? -most : most;
      if (wanted > size) wanted = size;
      if (wanted < -size) wanted = -size;
      CHECK_EQ(at(row, t_ms), wanted);
    }
  }
}

TEST_CASE("the least of a sine is nothing") {
  CardRow row = row_of(CardShape::kMultisine, 65535U, 500);
  row.components[0] = 1;
  row.components[1] = 128;
  row.components[2] = 1 << 6 | 1;
  CHECK_EQ(core::sin14(32769U), -1);
  CHECK_EQ(at(row, 1), 0);
}

TEST_CASE("no row deflects more than its amplitude, at any time") {
  Random random(4711);
  for (uint16_t n = 0; n < 400; ++n) {
    CardRow row = {};
    row.shape = static_cast<uint8_t>(1 + random.below(5));
    row.axes = 7;
    row.duration_ms = static_cast<uint16_t>(100 + random.below(19901));
    row.first_chz = static_cast<uint16_t>(1 + random.below(500));
    row.last_chz = static_cast<uint16_t>(1 + random.below(500));
    for (uint8_t i = 0; i < 3; ++i) {
      row.amplitude_us[i] = static_cast<int16_t>(random.below(1001) - 500);
    }
    for (uint8_t i = 0; i < 30; ++i) row.components[i] = random.byte();
    for (uint8_t i = 0; i < 50; ++i) {
      const uint16_t t_ms = random.below(20100);
      for (uint8_t axis = 0; axis < 3; ++axis) {
        const int16_t got = of_axis(row, axis, t_ms);
        const int16_t most = static_cast<int16_t>(2 * row.amplitude_us[axis]);
        CHECK((got >= -(most < 0 ? -most : most)));
        CHECK((got <= (most < 0 ? -most : most)));
        if (t_ms >= row.duration_ms) CHECK_EQ(got, 0);
      }
    }
  }
}
