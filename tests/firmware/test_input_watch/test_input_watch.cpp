// Every limit of the card, every sensor lost or stuck, distance, and the travel that was shown.
#include "check.h"
#include "core/input_watch.h"
#include "core/stick_travel.h"
#include "random_numbers.h"

namespace {

using core::InputMotion;
using core::InputReadings;
using frames::InputEnd;

struct Bench {
  core::InputLimits limits = {};
  InputReadings in = {};
  core::InputHome home;
  InputMotion motion;
  uint32_t now_us = 0xFFFFFFFFU - 700000U;
  uint8_t turn = 0;
  bool still[InputMotion::kSensors] = {};

  Bench() {
    limits.airspeed_input = 4;
    limits.alpha_input = 1;
    limits.beta_input = 2;
    limits.dp_min = 2100;
    limits.dp_max = 3000;
    limits.alpha_min = limits.beta_min = 1000;
    limits.alpha_max = limits.beta_max = 3000;
    limits.phi_max = 6000;
    limits.theta_min = -3000;
    limits.theta_max = 3500;
    limits.p_max = 20000;
    limits.q_max = 12000;
    limits.r_max = 11000;
    limits.az_min = -24000;
    limits.az_max = 100;
    limits.height_min_pa = 200;
    limits.height_max_pa = 2000;
    limits.distance_max_m = 300;
    limits.still_ms = 500;
    limits.rail_min = 1000;
    home.pressure_2pa = 50000;
    home.latitude = 250000000;
    home.cosine = core::home_cosine(home.latitude);
    home.longitude = 1210000000;
    in.force[2] = -8192;
    in.pitot[0] = in.pitot[1] = 2500;
    in.alpha[0] = in.alpha[1] = in.beta[0] = in.beta[1] = 2048;
    in.valid = 0xFFFF;
    in.rail = 2000;
    in.static_pressure = 16UL * 99000UL;
    in.latitude = home.latitude;
    in.longitude = home.longitude;
    in.imu = in.gps = true;
    motion.start(now_us);
    run(100);
  }

  // Every sensor moves a little, but those that stand still.
  void run(uint16_t ms) {
    for (; ms >= 5; ms = static_cast<uint16_t>(ms - 5)) {
      now_us += 5000;
      turn ^= 1U;
      if (!still[InputMotion::kImu]) in.rates[0] = turn;
      if (!still[InputMotion::kAirspeed]) in.pitot[0] = static_cast<uint16_t>(2500 + turn);
      if (!still[InputMotion::kAlpha]) in.alpha[1] = static_cast<uint16_t>(2048 + turn);
      if (!still[InputMotion::kBeta]) in.beta[0] = static_cast<uint16_t>(2048 + turn);
      if (!still[InputMotion::kBaro]) in.static_pressure = 16UL * 99000UL + turn;
      if (!still[InputMotion::kGps]) in.latitude = home.latitude + turn;
      motion.see_imu(in, now_us);
      motion.see_scan(limits, in, now_us);
      motion.see_baro(in, now_us);
      motion.see_gps(in, now_us);
      motion.age(now_us);
    }
  }
  int judge() const {
    core::InputWatch watch;
    watch.limits = limits;
    watch.start(now_us);
    watch.found[core::InputWatch::kImu] = core::judge_imu(limits, in);
    watch.found[core::InputWatch::kScan] = core::judge_scan(limits, in);
    watch.found[core::InputWatch::kBaro] = core::judge_baro(limits, in, home);
    watch.found[core::InputWatch::kGps] = core::judge_gps(limits, in, home);
    watch.found[core::InputWatch::kHeard] = core::judge_heard(limits, in, motion, now_us);
    return static_cast<int>(watch.outside());
  }
};

#define SAYS_IN(change, why)                                  \
  {                                                           \
    Bench bench;                                              \
    change;                                                   \
    CHECK_EQ(bench.judge(), static_cast<int>(InputEnd::why)); \
  }

}  // namespace

TEST_CASE("all limits hold, at their edges too"){
    SAYS_IN(, kDone) SAYS_IN(bench.in.phi = 6000, kDone) SAYS_IN(bench.in.phi = -6000, kDone)
        SAYS_IN(bench.in.theta = 3500, kDone) SAYS_IN(bench.in.theta = -3000, kDone)
            SAYS_IN(bench.in.rates[0] = -20000, kDone) SAYS_IN(bench.in.force[2] = 100, kDone)
                SAYS_IN(bench.in.force[2] = -24000, kDone) SAYS_IN(bench.in.pitot[0] = 2100, kDone)
                    SAYS_IN(bench.in.pitot[0] = 3000, kDone)
                        SAYS_IN(bench.in.alpha[1] = 1000, kDone)
                            SAYS_IN(bench.in.beta[0] = 3000, kDone)
                                SAYS_IN(bench.in.static_pressure = 16UL * 99800UL, kDone)
                                    SAYS_IN(bench.in.static_pressure = 16UL * 98000UL, kDone)
                                        SAYS_IN(bench.in.rail = 1000, kDone)}

TEST_CASE("each limit one step behind its edge"){
    SAYS_IN(bench.in.phi = 6001, kBank) SAYS_IN(bench.in.phi = -6001,
                                                kBank) SAYS_IN(bench.in.phi = INT16_MIN, kBank)
        SAYS_IN(bench.in.theta = 3501, kPitch) SAYS_IN(bench.in.theta = -3001, kPitch) SAYS_IN(
            bench.in.rates[0] = 20001, kRates) SAYS_IN(bench.in.rates[0] = -20001, kRates)
            SAYS_IN(bench.in.rates[1] = -12001, kRates) SAYS_IN(bench.in.rates[2] = 11001, kRates)
                SAYS_IN(bench.in.rates[2] = INT16_MIN, kRates) SAYS_IN(bench.in.force[2] = 101,
                                                                       kLoadFactor)
                    SAYS_IN(bench.in.force[2] = -24001,
                            kLoadFactor) SAYS_IN(bench.in.pitot[0] = 2099, kAirspeed)
                        SAYS_IN(bench.in.pitot[0] = 3001,
                                kAirspeed) SAYS_IN(bench.in.alpha[1] = 999,
                                                   kAlpha) SAYS_IN(bench.in.alpha[1] = 3001, kAlpha)
                            SAYS_IN(bench.in.beta[0] = 999,
                                    kBeta) SAYS_IN(bench.in.beta[0] = 3001, kBeta)
                                SAYS_IN(bench.in.static_pressure = 16UL * 99801UL, kHeight)
                                    SAYS_IN(bench.in.static_pressure = 16UL * 97999UL, kHeight)
                                        SAYS_IN(bench.in.static_pressure = 16UL * 110000UL, kHeight)
                                            SAYS_IN(bench.in.latitude += 30000, kDistance)
                                                SAYS_IN(bench.in.rail = 999, kSupply)}

TEST_CASE("edges that stand for one side, and a look that just came") {
  SAYS_IN(bench.in.phi = -1, kDone)
  SAYS_IN(bench.in.rates[1] = 12000, kDone)
  SAYS_IN(bench.in.rates[1] = 5, kDone)
  SAYS_IN(bench.in.rates[2] = 11000, kDone)
  SAYS_IN(bench.in.scan_age_us = 100000, kDone)
  SAYS_IN(bench.in.baro_age_us = 1, kDone)
  SAYS_IN(bench.in.baro_age_us = 150000, kDone)
  SAYS_IN(bench.in.gps_age_us = 1000000, kDone)
  SAYS_IN(bench.limits.rail_min = 1; bench.in.rail = 0, kSupply)
  // Below the place where the card was enabled, the card's height as high as can be written.
  SAYS_IN(bench.limits.height_max_pa = 65535U; bench.home.pressure_2pa = 25000;
          bench.in.static_pressure = 16UL * 51000UL, kHeight)
}

TEST_CASE("what the card does not name may stand still and be old") {
  for (uint8_t sensor = InputMotion::kAirspeed; sensor <= InputMotion::kGps; ++sensor) {
    if (sensor == InputMotion::kBaro) continue;  // height is always watched
    Bench bench;
    if (sensor == InputMotion::kAirspeed) bench.limits.airspeed_input = 255;
    if (sensor == InputMotion::kAlpha) bench.limits.alpha_input = 255;
    if (sensor == InputMotion::kBeta) bench.limits.beta_input = 255;
    if (sensor == InputMotion::kGps) {
      bench.limits.distance_max_m = 0;
      bench.in.gps_age_us = 5000000;
    }
    bench.still[sensor] = true;
    bench.run(3000);
    CHECK_EQ(bench.judge(), 0);
  }
  const uint8_t one_of[][3] = {{4, 255, 255}, {255, 1, 255}, {255, 255, 2}, {255, 255, 255}};
  for (const auto& inputs : one_of) {
    Bench bench;
    bench.limits.airspeed_input = inputs[0];
    bench.limits.alpha_input = inputs[1];
    bench.limits.beta_input = inputs[2];
    bench.in.scan_age_us = 100001;
    const bool none = &inputs == &one_of[3];
    CHECK_EQ(bench.judge(), none ? 0 : static_cast<int>(InputEnd::kSensorLost));
  }
}

TEST_CASE("what the card does not name is not watched") {
  SAYS_IN(bench.in.pitot[1] = 0, kDone)
  SAYS_IN(bench.in.alpha[0] = 0, kDone)
  SAYS_IN(bench.limits.airspeed_input = 255; bench.in.pitot[0] = 0, kDone)
  SAYS_IN(bench.limits.alpha_input = 255; bench.in.alpha[1] = 0, kDone)
  SAYS_IN(bench.limits.beta_input = 255; bench.in.beta[0] = 0, kDone)
  SAYS_IN(bench.limits.distance_max_m = 0; bench.in.gps = false, kDone)
  SAYS_IN(bench.limits.rail_min = 0; bench.in.rail = 0, kDone)
}

TEST_CASE("a sensor that is not heard, or open, or old, proves nothing"){
    SAYS_IN(bench.in.imu = false, kSensorLost) SAYS_IN(bench.in.imu_age_us = 30001, kSensorLost)
        SAYS_IN(bench.in.imu_age_us = 30000, kDone)
            SAYS_IN(bench.in.valid &= static_cast<uint16_t>(~0x10U), kSensorLost)
                SAYS_IN(bench.in.valid &= static_cast<uint16_t>(~0x02U), kSensorLost)
                    SAYS_IN(bench.in.valid &= static_cast<uint16_t>(~0x04U), kSensorLost)
                        SAYS_IN(bench.in.valid &= static_cast<uint16_t>(~0x01U), kDone)
                            SAYS_IN(bench.in.scan_age_us = 100001, kSensorLost)
                                SAYS_IN(bench.in.static_pressure = 0, kSensorLost)
                                    SAYS_IN(bench.in.baro_age_us = 150001, kSensorLost)
                                        SAYS_IN(bench.in.gps = false, kSensorLost)
                                            SAYS_IN(bench.in.gps_age_us = 1000001, kSensorLost)}

TEST_CASE("each sensor that stands still is stuck behind the card's time") {
  for (uint8_t sensor = 0; sensor < InputMotion::kSensors; ++sensor) {
    Bench bench;
    bench.still[sensor] = true;
    const bool gps = sensor == InputMotion::kGps;
    bench.run(gps ? 1450 : 450);
    CHECK_EQ(bench.judge(), 0);
    bench.run(100);
    CHECK_EQ(bench.judge(), static_cast<int>(InputEnd::kSensorStill));
    bench.run(10000);  // its count does not come round
    CHECK_EQ(bench.judge(), static_cast<int>(InputEnd::kSensorStill));
    bench.still[sensor] = false;
    bench.run(10);
    CHECK_EQ(bench.judge(), 0);
  }
}

TEST_CASE("at the start nothing has moved yet") {
  Bench bench;
  bench.motion.start(bench.now_us);
  CHECK_EQ(bench.judge(), static_cast<int>(InputEnd::kSensorStill));
}

TEST_CASE("however low a card lets it be, 120 Pa above home at least") {
  SAYS_IN(bench.limits.height_min_pa = 1; bench.in.static_pressure = 16UL * 99881UL, kHeight)
  SAYS_IN(bench.limits.height_min_pa = 1; bench.in.static_pressure = 16UL * 99880UL, kDone)
}

TEST_CASE("of a GPS that the card does not want no news is waited for") {
  core::InputWatch watch;
  watch.limits.distance_max_m = 0;
  watch.start(5);
  CHECK_EQ(static_cast<int>(watch.found[core::InputWatch::kGps]), 0);
}

TEST_CASE("until every part has been looked at nothing holds") {
  core::InputWatch watch;
  watch.limits.distance_max_m = 300;
  watch.start(5);
  CHECK_EQ(static_cast<int>(watch.found[core::InputWatch::kGps]),
           static_cast<int>(InputEnd::kSensorLost));
  // That of a hold is its row's.
  CHECK_EQ(static_cast<int>(watch.found[core::InputWatch::kHold]), 0);
  for (uint8_t at = 0; at < core::InputWatch::kHold; ++at) {
    InputEnd& part = watch.found[at];
    CHECK_EQ(static_cast<int>(watch.outside()), static_cast<int>(InputEnd::kSensorLost));
    part = InputEnd::kDone;
  }
  CHECK_EQ(static_cast<int>(watch.outside()), 0);
  watch.found[core::InputWatch::kGps] = InputEnd::kDistance;
  CHECK_EQ(static_cast<int>(watch.outside()), static_cast<int>(InputEnd::kDistance));
}

TEST_CASE("a sensor that nobody looks at does not come round while its time is kept") {
  Bench bench;
  bench.motion.see_gps(bench.in, bench.now_us);
  for (uint16_t n = 0; n < 2000; ++n) {
    bench.now_us += 5000;
    bench.motion.age(bench.now_us);
    const bool moves =
        bench.motion.moves(InputMotion::kGps, InputMotion::steps_of(1500), bench.now_us);
    if (n < 290) CHECK(moves);
    if (n > 305) CHECK(!moves);
  }
}

TEST_CASE("distances: metres, the cosine of the latitude, and far away") {
  core::InputHome home;
  home.latitude = 600000000;
  home.cosine = core::home_cosine(home.latitude);
  home.longitude = 100000000;
  const auto in = [&](int32_t north, int32_t east, uint16_t most_m) {
    return core::within_distance(home, home.latitude + north, home.longitude + east, most_m);
  };
  CHECK(in(26900, 0, 300));  // 299.5 m
  CHECK(!in(27100, 0, 300));
  CHECK(in(-26900, 0, 300));
  CHECK(in(0, 53400, 300));  // half of it at 60 deg
  CHECK(!in(0, 54600, 300));
  CHECK(in(-19000, 37900, 300));
  CHECK(!in(-19300, 38500, 300));
  CHECK(!in(0, 2000000000, 3000));
  CHECK(!in(-1200000000, 0, 3000));
  CHECK(in(0, 0, 1));
  home.longitude = 1799999999;
  CHECK(!core::within_distance(home, home.latitude, -1799999999, 3000));  // the date line: refused
}

TEST_CASE("far to the east is far, where its square comes round too") {
  core::InputHome home;
  home.cosine = core::home_cosine(home.latitude);
  CHECK(!core::within_distance(home, 0, 5883520, 3000));  // 65536 m
  CHECK(!core::within_distance(home, 5883520, 0, 3000));
  CHECK(core::within_distance(home, 0, -26900, 300));
  CHECK(!core::within_distance(home, 0, -27100, 300));
}

TEST_CASE("nothing has moved at the start, whatever the time is") {
  InputMotion motion;
  for (uint32_t now_us = 0; now_us < 5000000U; now_us += 16000) {
    motion.start(now_us);
    for (uint8_t sensor = 0; sensor < InputMotion::kSensors; ++sensor) {
      CHECK(!motion.moves(sensor, InputMotion::steps_of(2000), now_us));
    }
  }
}

TEST_CASE("a value that moves by any power of two has moved") {
  for (uint8_t bit = 0; bit < 16; ++bit) {
    Bench bench;
    bench.still[InputMotion::kBaro] = true;
    bench.run(600);
    CHECK(!bench.motion.moves(InputMotion::kBaro, InputMotion::steps_of(500), bench.now_us));
    bench.in.static_pressure ^= uint32_t{1} << bit;
    bench.motion.see_baro(bench.in, bench.now_us);
    CHECK(bench.motion.moves(InputMotion::kBaro, InputMotion::steps_of(500), bench.now_us));
  }
}

TEST_CASE("values that move together, and against each other, have moved") {
  struct Step {
    int16_t rates[3];
    int16_t force;
  };
  const Step steps[] = {{{1, -1, 0}, 0},
                        {{1, 1, 0}, 0},
                        {{3, 0, 0}, 0},
                        {{1, 3, 0}, 0},
                        {{0, 0, 1}, 0},
                        {{0, 1, 0}, 0},
                        {{0, 1, -1}, 0},
                        {{0, 1, 1}, 0},
                        {{0, 1, 3}, 0},
                        {{1, 0, 0}, 1}};
  for (const Step& step : steps) {
    Bench bench;
    bench.still[InputMotion::kImu] = true;
    bench.run(600);
    CHECK(!bench.motion.moves(InputMotion::kImu, InputMotion::steps_of(500), bench.now_us));
    for (uint8_t i = 0; i < 3; ++i) {
      bench.in.rates[i] = static_cast<int16_t>(bench.in.rates[i] + step.rates[i]);
    }
    bench.in.force[0] = static_cast<int16_t>(bench.in.force[0] + step.force);
    bench.motion.see_imu(bench.in, bench.now_us);
    CHECK(bench.motion.moves(InputMotion::kImu, InputMotion::steps_of(500), bench.now_us));
  }
  const int32_t places[][4] = {{0, 1000000000, 0, 1},
                               {10, 1000000000, 0, 1},
                               {250000000, 1210000000, 1, -1},
                               {250000000, 1210000000, 1, 1},
                               {250000000, 1210000000, 3, 0},
                               {250000000, 1210000000, 1, 3}};
  for (const auto& place : places) {
    Bench bench;
    bench.still[InputMotion::kGps] = true;
    bench.in.latitude = place[0];
    bench.in.longitude = place[1];
    bench.run(1600);
    CHECK(!bench.motion.moves(InputMotion::kGps, InputMotion::steps_of(1500), bench.now_us));
    bench.in.latitude += place[2];
    bench.in.longitude += place[3];
    bench.motion.see_gps(bench.in, bench.now_us);
    CHECK(bench.motion.moves(InputMotion::kGps, InputMotion::steps_of(1500), bench.now_us));
  }
}

TEST_CASE("a sensor may stand still for the whole steps of 16 ms within the card's time") {
  InputMotion motion;
  InputReadings in = {};
  motion.start(0);
  in.static_pressure = 77;
  motion.see_baro(in, 0);
  const auto moves = [&](uint16_t still_ms, uint32_t steps) {
    return motion.moves(InputMotion::kBaro, InputMotion::steps_of(still_ms), steps << 14);
  };
  CHECK(moves(819, 49));
  CHECK(!moves(819, 50));
  CHECK(moves(1016, 62));
  CHECK(!moves(1016, 63));
  CHECK_EQ(InputMotion::steps_of(4161), 253);
  CHECK_EQ(InputMotion::steps_of(4195), 255);
  CHECK_EQ(InputMotion::steps_of(65535U), 255);
}

TEST_CASE("a watch begins with nothing of what its memory was lent to") {
  core::InputWatch watch;
  const uint32_t now_us = 0x12345678;
  for (uint8_t i = 0; i < InputMotion::kSensors; ++i) {
    watch.motion.value[i] = 0x55;
    watch.motion.moved[i] = static_cast<uint8_t>(now_us >> 14);
  }
  watch.start(now_us);
  CHECK_EQ(watch.looked_us, 0x5678);
  InputReadings in = {};  // of nought, as what is there at the start
  watch.motion.see_gps(in, now_us);
  for (uint8_t i = 0; i < InputMotion::kSensors; ++i) {
    CHECK(!watch.motion.moves(i, InputMotion::steps_of(2000), now_us));
  }
}

TEST_CASE("a distance at its very limit is within, and one that comes round in 32 bits is far") {
  core::InputHome home;
  home.cosine = core::home_cosine(home.latitude);
  CHECK_EQ(home.cosine, 255);
  CHECK(core::within_distance(home, 35920, 0, 400));
  CHECK(core::within_distance(home, 0, 35920, 400));
  CHECK(!core::within_distance(home, 36000, 0, 400));
  CHECK(core::within_distance(home, -1, -1, 1));
  CHECK(!core::within_distance(home, 94136272, 0, 3000));  // 9.4 deg
}

TEST_CASE(
    "the cosine is that of the degree nearer to the equator, none at the pole and behind it") {
  CHECK_EQ(core::home_cosine(599999990), core::home_cosine(590000000));
  CHECK(core::home_cosine(600000000) < core::home_cosine(590000000));
  CHECK_EQ(core::home_cosine(900000000), 0);
  CHECK_EQ(core::home_cosine(INT32_MAX), 0);
}

TEST_CASE("200 us of travel are enough, 8 less are not") {
  const uint16_t ends[] = {2800, 2784};
  for (const uint16_t most_ticks : ends) {
    core::StickTravel travel;
    core::RcChannels rc = {{2600, 2600, 2600, 2200, 2200}, 0x1F, 0x1F};
    const uint16_t places[] = {2400, most_ticks};
    for (const uint16_t place : places) {
      for (uint8_t i = 0; i < core::kCardAxes; ++i) rc.width_ticks[i] = place;
      for (uint8_t n = 0; n < 60; ++n) travel.look(rc);
    }
    CHECK_EQ(travel.shown(), most_ticks == 2800);
  }
}

TEST_CASE("a stick is at its end within 32 us, and each axis must be moved") {
  for (uint8_t held = 0; held < core::kCardAxes; ++held) {
    core::StickTravel travel;
    core::RcChannels rc = {{3001, 2992, 3000, 2200, 2200}, 0x1F, 0x1F};
    travel.look(rc);
    CHECK_EQ(travel.least_ticks(0), 3008);
    CHECK_EQ(travel.most_ticks(1), 2992);
    CHECK_EQ(travel.most_ticks(2), 3008);
    for (uint16_t n = 0; n < 200; ++n) {
      for (uint8_t i = 0; i < core::kCardAxes; ++i) {
        rc.width_ticks[i] = i == held ? uint16_t{2992} : n < 100 ? uint16_t{2400} : uint16_t{3600};
      }
      travel.look(rc);
    }
    CHECK(!travel.shown());
    const uint8_t moved = held == 0 ? 1 : 0;
    const uint16_t least = travel.least_ticks(moved);
    const uint16_t most = travel.most_ticks(moved);
    CHECK(travel.at_end(moved, static_cast<uint16_t>(least + 64)));
    CHECK(!travel.at_end(moved, static_cast<uint16_t>(least + 65)));
    CHECK(travel.at_end(moved, static_cast<uint16_t>(most - 64)));
    CHECK(!travel.at_end(moved, static_cast<uint16_t>(most - 65)));
  }
}

TEST_CASE("travel is shown slowly, and one spoilt pulse adds one step") {
  core::StickTravel travel;
  core::RcChannels rc = {{3000, 3000, 3000, 2200, 2200}, 0x1F, 0x1F};
  travel.look(rc);
  CHECK(!travel.shown());
  CHECK_EQ(travel.least_ticks(0), travel.most_ticks(0));
  rc.width_ticks[0] = 4400;
  travel.look(rc);
  CHECK_EQ(travel.most_ticks(0) - travel.least_ticks(0), 16);
  const uint16_t most = travel.most_ticks(0);
  const uint16_t least = travel.least_ticks(0);
  rc.width_ticks[0] = 1700;
  travel.look(rc);
  CHECK_EQ(travel.least_ticks(0), least - 16);
  CHECK_EQ(travel.most_ticks(0), most);
  rc.width_ticks[0] = 3000;
  for (uint8_t side = 0; side < 2; ++side) {
    for (uint8_t i = 0; i < 3; ++i) rc.width_ticks[i] = side != 0 ? 3391 : 2609;
    for (uint16_t n = 0; n < 100; ++n) travel.look(rc);
  }
  for (uint8_t i = 0; i < 3; ++i) {
    CHECK(travel.least_ticks(i) >= 2609);  // rounded inwards
    CHECK(travel.least_ticks(i) < 2609 + 16);
    CHECK(travel.most_ticks(i) <= 3391);
    CHECK(travel.most_ticks(i) > 3391 - 16);
  }
  CHECK(travel.shown());
  CHECK(travel.at_end(1, 2609));
  CHECK(travel.at_end(1, 3391));
  CHECK(!travel.at_end(1, 3000));
  CHECK(!travel.at_end(1, 3300));
}

TEST_CASE("a channel that is not steady shows nothing, and all three must be moved") {
  core::StickTravel travel;
  core::RcChannels rc = {{3000, 3000, 3000, 2200, 2200}, 0x1F, 0b11101};
  for (uint16_t n = 0; n < 400; ++n) {
    for (uint8_t i = 0; i < 3; ++i) rc.width_ticks[i] = n < 200 ? 2400 : 3600;
    travel.look(rc);
  }
  CHECK(!travel.shown());
  CHECK(travel.least_ticks(1) > travel.most_ticks(1));
}

TEST_CASE("a sign is held for 3 s without a break, and counts once") {
  core::HeldSign sign;
  uint32_t now_us = 0xFFFFFFFFU - 1000000U;
  const auto held = [&](bool on, uint16_t ms) {
    uint8_t count = 0;
    for (; ms >= 8; ms = static_cast<uint16_t>(ms - 8)) {
      now_us += 8000;
      count = static_cast<uint8_t>(count + sign.look(on, now_us));
    }
    return count;
  };
  CHECK_EQ(held(true, 2960), 0);
  CHECK_EQ(held(false, 8), 0);
  CHECK_EQ(held(true, 2960), 0);
  CHECK_EQ(held(true, 120), 1);
  CHECK_EQ(held(true, 60000U), 0);
  CHECK_EQ(held(false, 100), 0);
  CHECK_EQ(held(true, 3100), 1);
}
