// Each witness by itself, on both sides of its limit.
#include "check.h"
#include "core/airborne.h"

namespace {

using core::AirborneInputs;
using core::FlightState;

// Seconds of so many samples each, the last at the second's end.
struct Seconds {
  core::Airborne airborne;
  uint32_t now_us = 0xFFFF0000U;

  explicit Seconds(bool flight_mark = false) { airborne.start(flight_mark, now_us); }

  bool run(const AirborneInputs& in, uint16_t samples = 25) {
    const uint32_t end_us = now_us + core::Airborne::kSecondUs;
    for (uint16_t i = 1; i < samples; ++i) {
      now_us += core::Airborne::kSecondUs / samples;
      airborne.step(in, now_us);
    }
    now_us = end_us;
    airborne.step(in, now_us);
    return airborne.moves();
  }
};

bool moves(const AirborneInputs& in) {
  Seconds one;
  return one.run(in);
}

AirborneInputs standing() {
  AirborneInputs in = {};
  in.gps = true;
  in.static_pressure = 1600000;
  return in;
}

// One IMU value that is `low` and `high` in turn.
bool swing_moves(uint8_t axis, int16_t low, int16_t high, bool original) {
  Seconds one;
  AirborneInputs in = {};
  in.imu = true;
  in.imu_original = original;
  for (uint8_t i = 1; i <= 25; ++i) {
    int16_t& value = axis < 3 ? in.rates[axis] : in.force[axis - 3];
    value = (i & 1U) != 0 ? low : high;
    one.now_us += 40000;
    one.airborne.step(in, one.now_us);
  }
  return one.airborne.moves();
}

}  // namespace

TEST_CASE("a second ends at its end, and a long one is one") {
  Seconds one;
  AirborneInputs in = {};
  in.gps = true;
  in.ground_speed_cmps = 900;
  one.airborne.step(in, one.now_us + 999999);
  CHECK(!one.airborne.moves());
  one.airborne.step(in, one.now_us + 1000000);
  CHECK(one.airborne.moves());
  in.ground_speed_cmps = 0;
  one.airborne.step(in, one.now_us + 9000000);
  CHECK(!one.airborne.moves());
  in.ground_speed_cmps = 900;
  one.airborne.step(in, one.now_us + 9999999);
  CHECK(!one.airborne.moves());
  one.airborne.step(in, one.now_us + 10000000);
  CHECK(one.airborne.moves());
}

TEST_CASE("GPS: 3 m/s is a walk") {
  AirborneInputs in = {};
  in.gps = true;
  in.ground_speed_cmps = 300;
  CHECK(!moves(in));
  in.ground_speed_cmps = 301;
  CHECK(moves(in));
  in.gps = false;
  CHECK(!moves(in));
}

TEST_CASE("throttle: above idle for the whole second, and heard") {
  AirborneInputs in = {};
  in.throttle_valid = true;
  CHECK(moves(in));
  in.throttle_valid = false;
  CHECK(!moves(in));
  in.throttle_valid = in.throttle_idle = true;
  CHECK(!moves(in));
  for (uint8_t other = 1; other <= 25; other = static_cast<uint8_t>(other + 6)) {
    Seconds one;
    for (uint8_t i = 1; i <= 25; ++i) {
      in.throttle_idle = i == other;
      one.now_us += 40000;
      one.airborne.step(in, one.now_us);
    }
    CHECK(!one.airborne.moves());
  }
}

TEST_CASE("a caller that looks more often than counts hold is judged by its first 250 looks") {
  AirborneInputs in = {};
  in.throttle_valid = true;
  Seconds one;
  CHECK(one.run(in, 600));
  in.throttle_idle = true;
  CHECK(!one.run(in, 600));
  in = standing();
  in.pitots = 1;
  in.pitot[0] = 2149;
  CHECK(one.run(in, 600));
  Seconds two;
  for (uint16_t i = 1; i <= 500; ++i) {
    in.pitot[0] = i <= 250 ? 2048 : 4000;
    two.now_us += 2000;
    two.airborne.step(in, two.now_us);
  }
  CHECK(!two.airborne.moves());
}

TEST_CASE("airspeed before the ground was seen: 100 counts above the middle, either pitot") {
  for (uint8_t pitot = 0; pitot < core::kPitots; ++pitot) {
    AirborneInputs in = {};
    in.pitots = static_cast<uint8_t>(1U << pitot);
    in.pitot[pitot] = 2148;
    in.pitot[1 - pitot] = 4000;  // open or shorted: nobody listens
    CHECK(!moves(in));
    in.pitot[pitot] = 2149;
    in.pitot[1 - pitot] = 0;
    CHECK(moves(in));
    in.pitots = 3;
    CHECK(moves(in));
    in.pitots = 0;
    CHECK(!moves(in));
  }
}

TEST_CASE("airspeed: more than half of the second's samples") {
  for (uint8_t fast = 12; fast <= 14; ++fast) {
    Seconds one;
    AirborneInputs in = {};
    in.pitots = 2;
    for (uint8_t i = 1; i <= 26; ++i) {
      in.pitot[1] = i <= fast ? 3000 : 2048;
      one.now_us += i == 26 ? 0 : 40000;
      one.airborne.step(in, i == 26 ? 0xFFFF0000U + 1000000U : one.now_us - 1);
    }
    CHECK_EQ(one.airborne.moves(), fast == 14);
  }
}

TEST_CASE(
    "the ground tells each pitot's zero, within the sensor's band; from there it is 50 counts") {
  const struct {
    uint16_t zero;
    bool taken;
  } cases[] = {{1842, false}, {1843, true}, {2048, true}, {2148, true}};
  for (uint8_t pitot = 0; pitot < core::kPitots; ++pitot) {
    for (const auto& one : cases) {
      Seconds world;
      AirborneInputs in = standing();
      in.pitots = static_cast<uint8_t>(1U << pitot);
      in.pitot[pitot] = one.zero;
      in.pitot[1 - pitot] = 2048;
      for (uint8_t s = 0; s < 8; ++s) {
        world.run(in);
      }
      REQUIRE(world.airborne.state() == FlightState::kGround);
      const uint16_t limit = static_cast<uint16_t>(one.taken ? one.zero + 50 : 2148);
      in.pitot[pitot] = limit;
      CHECK(!world.run(in));
      in.pitot[pitot] = static_cast<uint16_t>(limit + 1);
      CHECK(world.run(in));
    }
  }
  // Above the band: found to be the ground by 18 s of one witness against the others.
  for (uint16_t zero = 2253; zero <= 2254; ++zero) {
    Seconds world;
    AirborneInputs in = standing();
    in.pitots = 1;
    in.pitot[0] = zero;
    for (uint8_t s = 0; s < 20; ++s) {
      world.run(in);
    }
    REQUIRE(world.airborne.state() == FlightState::kGround);
    CHECK_EQ(world.airborne.moves(), zero == 2254);
    in.pitot[0] = 2303;
    CHECK_EQ(world.run(in), zero == 2254);
  }
}

TEST_CASE("pressure: 8 Pa from one second's mean to the next, up or down") {
  for (int16_t change = -130; change <= 130; change = static_cast<int16_t>(change + 1)) {
    Seconds one;
    AirborneInputs in = {};
    in.static_pressure = 1600000;
    CHECK(!one.run(in));
    in.static_pressure = static_cast<uint32_t>(1600000 + change);
    CHECK_EQ(one.run(in), change < -128 || change > 128);
    CHECK(!one.run(in));
  }
}

TEST_CASE("pressure: it is the mean that is compared, and a lost second has none") {
  Seconds one;
  AirborneInputs in = {};
  in.static_pressure = 1600000;
  one.run(in);
  for (uint8_t i = 1; i <= 25; ++i) {  // 1000 every fifth time is 200 on average
    in.static_pressure = i % 5 == 0 ? 1601000 : 1600000;
    one.now_us += 40000;
    one.airborne.step(in, one.now_us);
  }
  CHECK(one.airborne.moves());
  in.static_pressure = 0;
  CHECK(!one.run(in));
  in.static_pressure = 1700000;
  CHECK(!one.run(in));
  in.static_pressure = 1700129;
  CHECK(one.run(in));
  // A second that is lost in part has the mean of the rest.
  for (uint8_t i = 1; i <= 25; ++i) {
    in.static_pressure = i % 2 == 0 ? 0 : 1700129;
    one.now_us += 40000;
    one.airborne.step(in, one.now_us);
  }
  CHECK(!one.airborne.moves());
}

TEST_CASE("a pressure that stands still says still: two of it and GPS find the ground in 5 s") {
  Seconds one;
  AirborneInputs in = standing();
  for (uint8_t s = 0; s < 4; ++s) {
    one.run(in);
    CHECK(one.airborne.state() == FlightState::kInDoubt);
  }
  one.run(in);
  CHECK(one.airborne.state() == FlightState::kGround);
  Seconds alone;
  in.gps = false;
  for (uint8_t s = 0; s < 17; ++s) {
    alone.run(in);
    CHECK(alone.airborne.state() == FlightState::kInDoubt);
  }
  alone.run(in);
  CHECK(alone.airborne.state() == FlightState::kGround);
}

TEST_CASE("the IMU: 131 counts of rate, 500 of force from end to end, each axis") {
  for (uint8_t axis = 0; axis < 3; ++axis) {
    CHECK(!swing_moves(axis, -60, 71, false));
    CHECK(swing_moves(axis, -60, 72, false));
    CHECK(!swing_moves(axis, -10, 22, true));  // a quarter of the counts
    CHECK(swing_moves(axis, -10, 23, true));
  }
  for (uint8_t axis = 3; axis < 6; ++axis) {
    CHECK(!swing_moves(axis, -8192, -7692, false));
    CHECK(swing_moves(axis, -8192, -7691, false));
    CHECK(!swing_moves(axis, 200, -300, true));
    CHECK(swing_moves(axis, 201, -300, true));
    CHECK(!swing_moves(axis, 32000, 32000, false));
    CHECK(swing_moves(axis, -32768, 32767, false));
  }
}

TEST_CASE("the IMU: a steady rate beyond 25 deg/s, either way, each axis") {
  for (uint8_t axis = 0; axis < 3; ++axis) {
    for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
      const int16_t most = static_cast<int16_t>(sign * 1638);
      const int16_t more = static_cast<int16_t>(sign * 1639);
      CHECK(!swing_moves(axis, most, most, false));
      CHECK(swing_moves(axis, more, more, false));
      CHECK(!swing_moves(axis, most, more, false));  // once at most is enough to stay
      CHECK(!swing_moves(
          axis, static_cast<int16_t>(sign * 409), static_cast<int16_t>(sign * 409), true));
      CHECK(swing_moves(
          axis, static_cast<int16_t>(sign * 410), static_cast<int16_t>(sign * 410), true));
    }
  }
}

TEST_CASE("the IMU's extremes are a second's own, and none is heard of one that is lost") {
  Seconds one;
  AirborneInputs in = {};
  in.imu = true;
  in.rates[0] = 1000;
  CHECK(!one.run(in));
  in.rates[0] = -1000;
  CHECK(!one.run(in));
  in.rates[0] = 2000;
  in.imu = false;
  CHECK(!one.run(in));
}

TEST_CASE("the mark of a reset speaks for eight seconds to the second") {
  Seconds one(true);
  AirborneInputs in = {};
  for (uint8_t s = 1; s <= 8; ++s) {
    CHECK(one.run(in));
  }
  CHECK(!one.run(in));
  Seconds none(false);
  CHECK(!none.run(in));
}

TEST_CASE("two say still for five seconds on end; one that moves begins them anew") {
  Seconds one;
  AirborneInputs in = standing();
  one.run(in);
  one.run(in);
  one.run(in);
  in.throttle_valid = true;
  CHECK(one.run(in));
  in.throttle_valid = false;
  for (uint8_t s = 0; s < 4; ++s) {
    one.run(in);
    CHECK(one.airborne.state() == FlightState::kInDoubt);
  }
  one.run(in);
  CHECK(one.airborne.state() == FlightState::kGround);
}
