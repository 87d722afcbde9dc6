// Fixed-point trigonometry against tables, the attitude filter against motions known in advance.
#include "check.h"
#include "core/imu/attitude.h"
#include "core/imu/fixed_point.h"
#include "core/imu/rest_detector.h"
#include "random_numbers.h"

namespace {

using core::Attitude;
using core::AttitudeInput;
using core::AttitudeSettings;

constexpr int16_t kG = 8192;

int16_t off(int16_t value, int16_t truth) {
  const int32_t wide = int32_t{value} - truth;
  return static_cast<int16_t>(wide < 0 ? -wide : wide);
}

struct Filter {
  AttitudeSettings settings;
  Attitude attitude{settings};
  AttitudeInput in;

  Filter() {
    in.force[2] = -kG;
    settings.declination_cdeg = 0;
  }
  void run(uint16_t steps) {
    for (uint16_t i = 0; i < steps; ++i) {
      attitude.step(in, 5000);
      attitude.catch_up();
    }
  }
};

}  // namespace

TEST_CASE("atan2 in every octant, at its seams and at its ends") {
  struct Case {
    int32_t y, x;
    int16_t angle;
  };
  // tan(10 deg) and so on, times 2^20 and 2^30.
  const Case cases[] = {{0, INT32_C(1) << 20, 0},
                        {184890, 1048576, 1000},
                        {1048576, 1048576, 4500},
                        {1048576, 184890, 8000},
                        {INT32_C(1) << 20, 0, 9000},
                        {1048576, -184890, 10000},
                        {184890, -1048576, 17000},
                        {0, -1048576, 18000},
                        {-184890, -1048576, -17000},
                        {-1048576, -1, -9000},
                        {-1048576, 184890, -8000},
                        {-605394, 1048576, -3000},
                        {0, 0, 0},
                        {INT32_MAX, INT32_MAX, 4500},
                        {INT32_MIN, INT32_MIN, -13500},
                        {2, 1, 6343}};
  for (const Case& each : cases) {
    CHECK(off(core::atan2_cdeg(each.y, each.x), each.angle) <= 1);
  }
}

TEST_CASE("sine, square root") {
  const int16_t angles[] = {0, 3000, 4500, 9000, 15000, 18000, -3000, -9000, -12000};
  const int16_t sines[] = {0, 16384, 23170, 32767, 16384, 0, -16384, -32767, -28377};
  for (uint8_t i = 0; i < 9; ++i) {
    CHECK(off(core::sin_q15(angles[i]), sines[i]) <= 6);
  }
  CHECK_EQ(core::square_root(0), 0);
  CHECK_EQ(core::square_root(99), 9);
  CHECK_EQ(core::square_root(100), 10);
  CHECK_EQ(core::square_root(0xFFFFFFFFU), 65535);
}

TEST_CASE("at rest it settles on the attitude that gravity and field show, then says so") {
  Filter filter;
  // phi 30, theta -20: f = g (sin(theta), -cos(theta) sin(phi), -cos(theta) cos(phi)).
  filter.in.force[0] = -2802;
  filter.in.force[1] = -3849;
  filter.in.force[2] = -6667;
  // Heading 90: north (30, 0, 32) in body axes of that attitude.
  CHECK(!filter.attitude.valid());
  filter.run(Attitude::kSettleSteps);
  CHECK(filter.attitude.valid());
  CHECK(off(filter.attitude.phi_cdeg(), 3000) <= 5);
  CHECK(off(filter.attitude.theta_cdeg(), -2000) <= 5);
  CHECK(!filter.attitude.heading_valid());
}

TEST_CASE("a heading is found from the field, declination taken in, and lost with it") {
  Filter filter;
  filter.settings.declination_cdeg = 500;
  const int16_t west_of_nose[3] = {100, 400, 300};  // magnetic north 75.96 deg to the right
  for (uint8_t i = 0; i < 40; ++i) {
    filter.run(20);
    filter.attitude.set_field(west_of_nose);
  }
  CHECK(filter.attitude.heading_valid());
  CHECK(off(filter.attitude.psi_cdeg(), static_cast<int16_t>(-7596 + 500)) <= 30);
  CHECK(off(filter.attitude.phi_cdeg(), 0) <= 5);
  filter.run(101);
  CHECK(!filter.attitude.heading_valid());
}

TEST_CASE("rates turn it: a roll, a pitch and a heading of 90 deg, each way") {
  for (uint8_t axis = 0; axis < 3; ++axis) {
    for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
      Filter filter;
      filter.run(Attitude::kSettleSteps);
      filter.in.accel_saturated = true;                           // gyro alone
      filter.in.rates[axis] = static_cast<int16_t>(sign * 5895);  // 90.0 deg/s
      filter.run(1);
      filter.run(axis == 1 ? 177 : 199);
      filter.in.rates[axis] = 0;
      filter.run(1);
      const int16_t angle = axis == 0   ? filter.attitude.phi_cdeg()
                            : axis == 1 ? filter.attitude.theta_cdeg()
                                        : filter.attitude.psi_cdeg();
      CHECK(off(angle, static_cast<int16_t>(sign * (axis == 1 ? 8010 : 9000))) <= 10);
    }
  }
}

TEST_CASE("the filter's delay is made up for: a steady roll reads as it is at the sample") {
  Filter filter;
  filter.run(Attitude::kSettleSteps);
  filter.in.accel_saturated = true;
  filter.in.rates[0] = 6550;  // 100 deg/s times 2.8 ms is 0.28 deg
  filter.run(1);
  const int16_t before = filter.attitude.phi_cdeg();
  filter.settings.filter_delay_us = 0;
  Filter plain;
  plain.settings.filter_delay_us = 0;
  plain.run(Attitude::kSettleSteps);
  plain.in = filter.in;
  plain.run(1);
  CHECK(off(static_cast<int16_t>(before - plain.attitude.phi_cdeg()), 28) <= 1);
}

TEST_CASE("the first sample's rate stands for the time before it, too") {
  Filter filter;
  filter.settings.filter_delay_us = 0;
  filter.in.accel_saturated = true;
  filter.in.rates[0] = 26200;  // 400 deg/s for 5 ms
  filter.attitude.step(filter.in, 5000);
  CHECK(off(filter.attitude.phi_cdeg(), 200) <= 1);
}

TEST_CASE("a gyro bias is learned in flight, and within seconds at rest") {
  Filter filter;
  filter.run(Attitude::kSettleSteps);
  filter.in.rates[0] = 33;  // 0.5 deg/s
  filter.run(1000);
  const int16_t after_5s = filter.attitude.bias(0);
  CHECK(after_5s < 30);
  const int16_t means[3] = {33, 0, 0};
  filter.attitude.set_rest_rates(means);
  filter.attitude.set_at_rest(true);
  filter.run(500);
  CHECK(off(filter.attitude.bias(0), 33) <= 1);
  CHECK(off(filter.attitude.bias(1), 0) <= 1);
  filter.attitude.forget_bias();
  CHECK_EQ(filter.attitude.bias(0), 0);
}

TEST_CASE("the first rest says all of a chip's offset, later ones 5 deg/s more of it") {
  Filter filter;
  filter.run(Attitude::kSettleSteps);
  const int16_t means[3] = {1310, -1310, 1638};  // 20 deg/s, and all that counts as rest
  for (uint8_t axis = 0; axis < 3; ++axis) filter.in.rates[axis] = means[axis];
  filter.attitude.set_rest_rates(means);
  filter.run(2000);
  CHECK(off(filter.attitude.phi_cdeg(), 0) <= 10);
  CHECK(off(filter.attitude.theta_cdeg(), 0) <= 10);
  for (uint8_t axis = 0; axis < 3; ++axis) CHECK(off(filter.attitude.bias(axis), means[axis]) <= 1);
  const int16_t turn[3] = {1310, -1310, 0};
  filter.attitude.set_rest_rates(turn);
  CHECK(off(filter.attitude.bias(2), 1638 - 327) <= 1);
  filter.attitude.forget_bias();
  for (uint8_t axis = 0; axis < 3; ++axis) CHECK_EQ(filter.attitude.bias(axis), 0);
}

TEST_CASE("a coordinated turn at 60 deg does not pull it level when the speed is known") {
  // 18 m/s at 60 deg: g tan(60) / V = 0.9436 rad/s; q = r' sin, r = r' cos; f = (0, 0, -2 g).
  for (uint8_t known = 0; known < 2; ++known) {
    Filter filter;
    filter.in.force[1] = -7094;  // held at 60 deg bank on the ground
    filter.in.force[2] = -4096;
    filter.run(Attitude::kSettleSteps);
    filter.in.rates[1] = 3067;
    filter.in.rates[2] = 1771;
    filter.in.force[1] = 0;
    filter.in.force[2] = -16384;
    for (uint8_t second = 0; second < 6; ++second) {
      if (known != 0) {
        filter.attitude.set_speed(1800);
      }
      filter.run(200);
    }
    CHECK(off(filter.attitude.phi_cdeg(), 6000) <= 60);
    CHECK(off(filter.attitude.theta_cdeg(), 0) <= 60);
  }
}

#ifndef __AVR__  // 49 000 steps: what an int of 16 bits changes shows in the six seconds above
TEST_CASE(
    "a minute of turning at 30 deg is learned from where the speed is known, else not at all") {
  // 18 m/s: g tan(30) / V = 0.3145 rad/s, 25 deg/s of q and r together: between the 16 deg/s up to
  // which something is learned without a speed and the 62 with one.
  const uint16_t speeds_cmps[] = {0, 1800};
  for (const uint16_t speed_cmps : speeds_cmps) {
    Filter filter;
    filter.in.force[1] = -4096;
    filter.in.force[2] = -7094;
    filter.run(Attitude::kSettleSteps);
    filter.in.rates[1] = 590;
    filter.in.rates[2] = 1022;
    filter.in.force[1] = 0;
    filter.in.force[2] = -9459;
    for (uint8_t second = 0; second < 60; ++second) {
      if (speed_cmps != 0) filter.attitude.set_speed(speed_cmps);
      filter.run(200);
    }
    CHECK(off(filter.attitude.phi_cdeg(), 3000) <= 60);
    CHECK(off(filter.attitude.theta_cdeg(), 0) <= 60);
    // A bank that is 5 deg wrong is put right by gravity, which only the known speed lays open.
    filter.in.rates[0] = 1638;
    filter.run(40);
    filter.in.rates[0] = 0;
    for (uint8_t second = 0; second < 60; ++second) {
      if (speed_cmps != 0) filter.attitude.set_speed(speed_cmps);
      filter.run(200);
    }
    CHECK_EQ(off(filter.attitude.phi_cdeg(), 3000) <= 150, speed_cmps != 0);
  }
}
#endif

TEST_CASE(
    "a saturated gyro makes the attitude invalid for ten seconds, a saturated accelerometer not") {
  Filter filter;
  filter.run(Attitude::kSettleSteps);
  filter.in.accel_saturated = true;
  filter.run(5);
  CHECK(filter.attitude.valid());
  filter.in.accel_saturated = false;
  filter.in.gyro_saturated = true;
  filter.run(1);
  CHECK(!filter.attitude.valid());
  filter.in.gyro_saturated = false;
  filter.run(Attitude::kRecoverSteps - Attitude::kSamplesPerCorrection);
  CHECK(!filter.attitude.valid());
  filter.run(2 * Attitude::kSamplesPerCorrection);
  CHECK(filter.attitude.valid());
}

TEST_CASE("a start in a steep turn is not valid before gravity was seen for three seconds") {
  for (uint8_t known = 0; known < 2; ++known) {
    Filter filter;
    // 15 m/s at 45 deg: 0.6538 rad/s, 1.41 g along z.
    filter.in.rates[1] = 1735;
    filter.in.rates[2] = 1735;
    filter.in.force[2] = -11585;
    for (uint8_t second = 0; second < 6; ++second) {
      if (known != 0) {
        filter.attitude.set_speed(1500);
      }
      filter.run(200);
      CHECK(!filter.attitude.valid());
    }
    filter.in.rates[1] = filter.in.rates[2] = 0;
    filter.in.force[2] = -kG;
    filter.run(Attitude::kSettleSteps - Attitude::kSamplesPerCorrection);
    CHECK(!filter.attitude.valid());
    filter.run(2 * Attitude::kSamplesPerCorrection);
    CHECK(filter.attitude.valid());
    CHECK(off(filter.attitude.phi_cdeg(), 0) <= 20);
  }
}

TEST_CASE("no input overflows: full scale on every channel, any time step, leaves a rotation") {
  Filter filter;
  const int16_t ends[] = {INT16_MIN + 1, INT16_MAX, 0, -8192};
  uint32_t random = 1;
  for (uint16_t i = 0; i < 400; ++i) {
    for (uint8_t axis = 0; axis < 3; ++axis) {
      next_random(random);
      filter.in.rates[axis] = ends[(random >> 24) & 3];
      filter.in.force[axis] = ends[(random >> 26) & 3];
    }
    filter.attitude.set_speed(static_cast<uint16_t>(random >> 16));
    const int16_t field[3] = {filter.in.rates[0], filter.in.rates[1], filter.in.rates[2]};
    filter.attitude.set_field(field);
    filter.attitude.step(filter.in, i % 7 == 0 ? 0xFFFFFFFFU : i % 5 * 1000U);
  }
  Filter calm;
  filter.in = calm.in;
  const int16_t means[3] = {0, 0, 0};
  filter.attitude.set_rest_rates(means);
  filter.run(3000);
  CHECK(off(filter.attitude.phi_cdeg(), 0) <= 600);
  CHECK(off(filter.attitude.theta_cdeg(), 0) <= 600);
}

TEST_CASE("rest: two still seconds, told apart from a hand, from flight and from a steady turn") {
  core::RestDetector rest;
  int16_t rates[3] = {100, -200, 300};
  int16_t force[3] = {500, 0, -8150};
  for (uint16_t i = 0; i < 399; ++i) {
    rates[0] = static_cast<int16_t>(100 + (i % 2 == 0 ? 10 : -10));
    rest.add(rates, force);
    CHECK(!rest.at_rest());
  }
  rest.add(rates, force);
  REQUIRE(rest.at_rest());
  CHECK_EQ(rest.mean_rate(0), 100);
  CHECK_EQ(rest.mean_rate(1), -200);
  CHECK_EQ(rest.mean_force(2), -8150);
  CHECK(rest.take_means());
  CHECK(!rest.take_means());
  rates[1] = 0;  // 3 deg/s of jerk
  rest.add(rates, force);
  rates[1] = -200;
  rest.add(rates, force);
  CHECK(!rest.at_rest());
  // A steady turn: quiet, but fast, and another time too heavy.
  core::RestDetector turn;
  int16_t steady[3] = {0, 2000, 1000};
  for (uint16_t i = 0; i < 800; ++i) {
    turn.add(steady, force);
  }
  CHECK(!turn.at_rest());
  core::RestDetector heavy;
  int16_t none[3] = {0, 0, 0};
  int16_t pull[3] = {0, 0, -9500};
  for (uint16_t i = 0; i < 800; ++i) {
    heavy.add(none, pull);
  }
  CHECK(!heavy.at_rest());
}

TEST_CASE("the rounded upper half of a product, against 64 bits: random factors and the ends") {
  const int32_t ends[] = {
      0, 1, -1, INT32_MAX, -INT32_MAX, INT32_C(1) << 30, 0x7FFF, 0x8000, -0x10000};
  uint32_t random = 12345;
  uint16_t wrong = 0;
  for (uint16_t i = 0; i < 4000; ++i) {
    next_random(random);
    const int32_t a = i % 5 == 0 ? ends[i % 9] : static_cast<int32_t>(random) >> (i % 31);
    next_random(random);
    const int32_t b = i % 7 == 0 ? ends[i / 7 % 9] : static_cast<int32_t>(random);
    const int64_t product = static_cast<int64_t>(a) * b + 0x80000000LL;
    wrong = static_cast<uint16_t>(
        wrong + (core::mul_high(a, b) == static_cast<int32_t>(product >> 32) ? 0 : 1));
  }
  CHECK_EQ(wrong, 0);
}

TEST_CASE("steps of 40 ms, one after the other, at whatever rates: nothing overflows") {
  Random random(40);
  core::AttitudeSettings settings;
  for (uint8_t kind = 0; kind < 4; ++kind) {
    core::Attitude attitude(settings);
    for (uint16_t i = 0; i < 1500; ++i) {
      core::AttitudeInput in;
      const uint8_t down = static_cast<uint8_t>(random.below(3));
      in.force[down] = random.below(2) == 0 ? int16_t{8192} : int16_t{-8192};
      int16_t field[3];
      for (uint8_t axis = 0; axis < 3; ++axis) {
        const int16_t any = static_cast<int16_t>(random.below(65535) - 32768);
        in.rates[axis] = kind == 3 ? any : axis <= kind ? int16_t{32767} : int16_t{0};
        field[axis] = static_cast<int16_t>(random.below(4095) - 2048);
      }
      attitude.step(in, 40000);
      attitude.set_field(field);
      CHECK(attitude.theta_cdeg() >= -9001);
      CHECK(attitude.theta_cdeg() <= 9001);
    }
  }
}
