// Flying or on the ground: the table of airborne.h row by row, each sensor stuck or missing, random
// worlds. Stepped every 40 ms.
#include "check.h"
#include "core/airborne.h"
#include "random_numbers.h"

namespace {

using core::FlightState;

enum Witness : uint8_t { kThrottle, kAirspeed, kGps, kPressure, kImu, kWitnesses };
enum class Says : uint8_t { kNothing, kStill, kMoving };

struct World {
  core::Airborne airborne;
  uint32_t now_us = 0xFFFFFFFFU - 3000000U;  // the clock wraps on the way
  Says says[kWitnesses] = {Says::kNothing, Says::kStill, Says::kStill, Says::kStill, Says::kStill};
  uint16_t steps = 0;
  uint32_t pressure = 1621200;

  explicit World(bool flight_mark = false) { airborne.start(flight_mark, now_us); }

  core::AirborneInputs inputs() {
    core::AirborneInputs in = {};
    const bool odd = (steps & 1U) != 0;
    in.throttle_valid = says[kThrottle] != Says::kNothing;
    in.throttle_idle = says[kThrottle] != Says::kMoving;
    in.pitots = says[kAirspeed] == Says::kNothing ? 0 : 1;
    in.pitot[0] = says[kAirspeed] == Says::kMoving ? 2200 : 2040;
    in.gps = says[kGps] != Says::kNothing;
    in.ground_speed_cmps = says[kGps] == Says::kMoving ? 900 : 40;
    if (says[kPressure] == Says::kMoving) {
      pressure += 8;  // 200 a second: 12.5 Pa, 1 m/s down
    }
    in.static_pressure = says[kPressure] == Says::kNothing ? 0 : pressure + (odd ? 80 : 0);
    in.imu = says[kImu] != Says::kNothing;
    in.rates[0] = odd ? 30 : -20;
    in.force[2] = odd ? -8100 : -8250;
    if (says[kImu] == Says::kMoving) {
      in.rates[1] = odd ? 100 : -100;
    }
    return in;
  }
  FlightState run_s(uint8_t seconds) {
    for (uint16_t i = 0; i < 25U * seconds; ++i) {
      now_us += 40000;
      ++steps;
      airborne.step(inputs(), now_us);
    }
    return airborne.state();
  }
  // Seconds until it says ground, 255 if it does not within the minute.
  uint8_t ground_after_s() {
    for (uint8_t second = 1; second <= 60; ++second) {
      if (run_s(1) == FlightState::kGround) {
        return second;
      }
    }
    return 255;
  }
};

}  // namespace

TEST_CASE("all still: in doubt for 5 s, then ground") {
  World world;
  CHECK(world.run_s(4) == FlightState::kInDoubt);
  CHECK(world.run_s(2) == FlightState::kGround);
}

TEST_CASE("a receiver that is silent or idle says nothing of the ground") {
  World silent;
  for (Says& says : silent.says) {
    says = Says::kNothing;
  }
  CHECK(silent.run_s(17) == FlightState::kInDoubt);
  CHECK(silent.run_s(2) == FlightState::kGround);
  World idle;
  for (Says& says : idle.says) {
    says = Says::kNothing;
  }
  idle.says[kThrottle] = Says::kStill;
  CHECK(idle.run_s(17) == FlightState::kInDoubt);
}

TEST_CASE("any two that move are flying within 2 s, and stay so") {
  for (uint8_t a = 0; a < kWitnesses; ++a) {
    for (uint8_t b = 0; b < a; ++b) {
      World world;
      world.run_s(30);
      CHECK(world.airborne.state() == FlightState::kGround);
      world.says[a] = world.says[b] = Says::kMoving;
      world.run_s(2);
      CHECK(world.airborne.state() == FlightState::kFlying);
      CHECK(world.run_s(100) == FlightState::kFlying);
    }
  }
}

TEST_CASE("an aircraft that stands still, any one sensor stuck or missing, is ready in 18 s") {
  for (uint8_t stuck = 0; stuck < kWitnesses; ++stuck) {
    World moving;
    moving.says[stuck] = Says::kMoving;
    const uint8_t after_s = moving.ground_after_s();
    CHECK(after_s >= 18);
    CHECK(after_s <= 19);
    CHECK(moving.run_s(200) == FlightState::kGround);
    World missing;
    missing.says[stuck] = Says::kNothing;
    CHECK(missing.ground_after_s() <= 7);
  }
}

TEST_CASE("no one alone holds flying against the others") {
  for (uint8_t stuck = 0; stuck < kWitnesses; ++stuck) {
    World world;
    for (Says& says : world.says) {
      says = Says::kMoving;
    }
    CHECK(world.run_s(3) == FlightState::kFlying);
    for (uint8_t other = 0; other < kWitnesses; ++other) {
      world.says[other] = other == stuck ? Says::kMoving : Says::kStill;
    }
    CHECK(world.run_s(17) == FlightState::kFlying);
    CHECK(world.run_s(3) == FlightState::kGround);
  }
}

TEST_CASE("one that moves and nobody to speak against it stays in doubt") {
  World world;
  for (Says& says : world.says) {
    says = Says::kNothing;
  }
  world.says[kImu] = Says::kMoving;
  CHECK(world.run_s(200) == FlightState::kInDoubt);
  CHECK(world.airborne.moves());
}

TEST_CASE("idle glide behind a supply dip, any one sensor missing: never ground") {
  for (uint8_t missing = 0; missing < kWitnesses; ++missing) {
    World world;
    world.says[kThrottle] = Says::kNothing;  // the receiver boots, then says idle
    world.says[kAirspeed] = world.says[kPressure] = world.says[kImu] = Says::kMoving;
    world.says[kGps] = Says::kNothing;  // no fix yet
    world.says[missing] = Says::kNothing;
    CHECK(world.run_s(3) == FlightState::kFlying);
    world.says[kThrottle] = Says::kStill;
    CHECK(world.run_s(200) == FlightState::kFlying);
  }
}

TEST_CASE("the mark of a reset speaks for 8 s, then for nothing") {
  World still(true);
  CHECK(still.run_s(12) == FlightState::kInDoubt);
  CHECK(still.run_s(2) == FlightState::kGround);
  for (uint8_t stuck = 0; stuck < kWitnesses; ++stuck) {
    World two(true);
    two.says[stuck] = Says::kMoving;
    CHECK(two.ground_after_s() <= 27);
  }
  World gliding(true);
  gliding.says[kPressure] = Says::kMoving;
  CHECK(gliding.run_s(3) == FlightState::kFlying);
}

TEST_CASE("a calm glide is flying by its sink and its speed alone, a pitot by its offset is not") {
  World world;
  world.says[kAirspeed] = Says::kMoving;
  world.says[kPressure] = Says::kMoving;
  world.says[kGps] = Says::kNothing;
  CHECK(world.run_s(3) == FlightState::kFlying);
  // A pitot's offset looks like speed until the ground has shown it, from then on it does not.
  World offset;
  offset.says[kAirspeed] = Says::kMoving;
  CHECK(offset.run_s(18) != FlightState::kInDoubt);
  offset.run_s(3);
  CHECK(!offset.airborne.moves());
}

TEST_CASE("the IMU: a steady turn moves, noise and original packets at rest do not") {
  core::Airborne airborne;
  airborne.start(false, 0);
  core::AirborneInputs in = {};
  in.imu = true;
  in.rates[2] = 1700;  // 26 deg/s
  in.force[2] = -8192;
  for (uint8_t i = 0; i < 60; ++i) {
    airborne.step(in, i * 40000UL);
  }
  CHECK(airborne.moves());
  in.imu_original = true;
  in.rates[2] = 400;  // 24 deg/s of 16.4 counts
  for (uint8_t i = 60; i < 120; ++i) {
    airborne.step(in, i * 40000UL);
  }
  CHECK(!airborne.moves());
  for (uint8_t i = 120; i < 180; ++i) {
    in.rates[0] = (i & 1U) != 0 ? 40 : 0;  // 2.4 deg/s
    airborne.step(in, i * 40000UL);
  }
  CHECK(airborne.moves());
}

TEST_CASE("random worlds: two honest witnesses are never overruled, one liar never for long") {
  Random random(12);
  for (uint8_t world_number = 0; world_number < 40; ++world_number) {
    const bool mark = (random.byte() & 1U) != 0;
    World world(mark);
    const bool flies = (random.byte() & 1U) != 0;
    const uint8_t first = static_cast<uint8_t>(random.below(kWitnesses));
    const uint8_t second = static_cast<uint8_t>((first + 1 + random.below(4)) % kWitnesses);
    uint8_t ground_s = 0;
    for (uint8_t second_number = 0; second_number < 60; ++second_number) {
      for (uint8_t i = 0; i < kWitnesses; ++i) {
        const Says any = static_cast<Says>(random.below(3));
        const bool honest = flies ? i == first || i == second : i != first;
        world.says[i] = !honest ? any : flies ? Says::kMoving : i == kThrottle ? any : Says::kStill;
        if (!flies && i == kThrottle && i != first) {
          world.says[i] = any == Says::kMoving ? Says::kStill : any;
        }
      }
      const FlightState state = world.run_s(1);
      if (flies && second_number >= 2) {
        CHECK(state == FlightState::kFlying);
      }
      ground_s = static_cast<uint8_t>(state == FlightState::kGround ? ground_s + 1 : 0);
    }
    if (!flies) {
      CHECK(ground_s >= (mark ? 32 : 40));  // since 28 s and 20 s at the latest
    }
  }
}
