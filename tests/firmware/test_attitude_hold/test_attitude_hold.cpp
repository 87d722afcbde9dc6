// The hold of a row: its law against double precision over the range of gains and angles, what
// bounds it, and that it gives up where it loses.
#include "check.h"
#include "core/attitude_hold.h"
#include "core/input_command.h"
#include "random_numbers.h"

#ifdef __AVR__
#include <avr/io.h>
#endif

namespace {

using core::AttitudeHold;
using core::HeldAxis;
using core::InputReadings;
using frames::InputEnd;

constexpr uint16_t kRateUsps = 4000;
constexpr uint8_t kBoth = 3;

frames::CardHoldLayout gains() {
  frames::CardHoldLayout card = {};
  for (uint8_t axis = 0; axis < core::kHeldAxes; ++axis) {
    card.angle_gain[axis] = 3277;    // 0.2 ticks per 0.01 deg
    card.integral_gain[axis] = 350;  // a third of it a second
    card.rate_gain[axis] = 1000;
    card.authority_us[axis] = 100;
  }
  return card;
}

InputReadings level() {
  InputReadings in = {};
  in.imu = true;
  return in;
}

// The same law where nothing is rounded.
struct Exact {
  double integral = 0;
  double demand(const frames::CardHoldLayout& card, double error, double rate) {
    const double most = 2.0 * card.authority_us[0];
    const double sum =
        card.angle_gain[0] / 16384.0 * error - card.rate_gain[0] / 16384.0 * rate + integral;
    if (sum >= most) return most;
    if (sum <= -most) return -most;
    integral += card.integral_gain[0] / 1048576.0 * error;
    if (integral > most) integral = most;
    if (integral < -most) integral = -most;
    return sum;
  }
};

int16_t between(Random& random, int16_t least, int16_t most) {
  const uint16_t span = static_cast<uint16_t>(static_cast<int32_t>(most) - least);
  return static_cast<int16_t>(least + static_cast<int32_t>(random.below(span)));
}

struct Bench {
  AttitudeHold hold = {};
  InputReadings in = level();
  int16_t applied[core::kCardAxes] = {};
  uint32_t now_us = 0xFFFFF000U;
  frames::CardHoldLayout card = gains();

  void start(uint8_t held = kBoth, uint16_t rate_usps = kRateUsps) {
    hold.load(card, held, rate_usps);
    CHECK((hold.may_start(in) == InputEnd::kDone));
    hold.start(now_us);
  }
  InputEnd step(uint16_t rest_us = 5000) {
    now_us += rest_us;
    in.force[1] = static_cast<int16_t>(in.force[1] ^ 1);  // a sensor has noise
    return again();
  }
  InputEnd again() { return hold.step(in, applied, now_us); }
};

}  // namespace

TEST_CASE("the law is that of double precision to a tick, over the range") {
  Random random(49);
  double worst = 0;
#ifdef __AVR__
  constexpr uint16_t kFlights = 20;
#else
  constexpr uint16_t kFlights = 2000;
#endif
  for (uint16_t flight = 0; flight < kFlights; ++flight) {
    frames::CardHoldLayout card = gains();
    const bool down = random.below(2) != 0;
    const int16_t sign = down ? -1 : 1;
    card.angle_gain[0] = static_cast<int16_t>(sign * between(random, 1, 32767));
    card.integral_gain[0] = static_cast<int16_t>(sign * between(random, 0, 32767));
    card.rate_gain[0] = static_cast<int16_t>(sign * between(random, 0, 32767));
    card.authority_us[0] = static_cast<uint16_t>(between(random, 1, 500));
    const int16_t wanted = between(random, -1500, 1500);
    HeldAxis axis = {};
    axis.load(card, 0);
    axis.start(wanted);
    Exact exact;
    // Small motions mostly, so that the integral moves; now and then the ends of the range.
    const int16_t reach = flight % 4 == 0 ? int16_t{4500} : int16_t{60};
    for (uint8_t sample = 0; sample < 200; ++sample) {
      const int16_t angle = flight % 4 == 0
                                ? between(random, static_cast<int16_t>(-reach), reach)
                                : static_cast<int16_t>(wanted + between(random, -60, 60));
      const int16_t rate =
          flight % 4 == 0 ? between(random, INT16_MIN, INT16_MAX) : between(random, -50, 50);
      const double right = exact.demand(card, wanted - angle, rate);
      const double off = axis.demand(angle, rate) - right;
      if (off > worst) worst = off;
      if (-off > worst) worst = -off;
    }
  }
  // Half a tick of rounding and the integral's cut: 2^-14. A double of the AVR is a single.
#ifdef __AVR__
  CHECK(worst < 0.6);
#else
  CHECK(worst < 0.5002);
#endif
}

TEST_CASE("the surface goes against the error, whichever way its servo turns") {
  for (int16_t sign = -1; sign <= 1; sign = static_cast<int16_t>(sign + 2)) {
    HeldAxis axis = {};
    frames::CardHoldLayout card = gains();
    card.angle_gain[0] = static_cast<int16_t>(sign * card.angle_gain[0]);
    card.integral_gain[0] = static_cast<int16_t>(sign * card.integral_gain[0]);
    card.rate_gain[0] = static_cast<int16_t>(sign * card.rate_gain[0]);
    axis.load(card, 0);
    axis.start(0);
    CHECK(sign * axis.demand(500, 0) < 0);  // right wing down: to the left
    CHECK(sign * axis.demand(0, 500) < 0);  // rolling right: to the left
    CHECK(sign * axis.demand(-500, 0) > 0);
  }
}

TEST_CASE("the demand never leaves the authority, and the integral rests beyond it") {
  HeldAxis axis = {};
  axis.load(gains(), 0);
  axis.start(0);
  for (uint16_t sample = 0; sample < 2000; ++sample) CHECK_EQ(axis.demand(4500, 0), -200);
  // Nothing was wound up: level again is a demand of zero.
  CHECK_EQ(axis.demand(0, 0), 0);
}

TEST_CASE("the integral alone reaches the authority and no more, and comes back") {
  HeldAxis axis = {};
  axis.load(gains(), 0);
  axis.start(0);
  int16_t demand = 0;
  for (uint16_t sample = 0; sample < 6000; ++sample) demand = axis.demand(300, 0);
  CHECK_EQ(demand, -200);
  for (uint16_t sample = 0; sample < 400; ++sample) demand = axis.demand(-300, 0);
  CHECK(demand > -100);
}

TEST_CASE("a row begins within 20 deg of bank, 15 of pitch, 30 deg/s, with an attitude") {
  const auto says = [](int16_t phi, int16_t theta, int16_t rate, uint8_t which, bool imu) {
    AttitudeHold hold = {};
    InputReadings in = level();
    in.phi = phi;
    in.theta = theta;
    in.rates[which] = rate;
    in.imu = imu;
    return hold.may_start(in);
  };
  CHECK((says(2000, -1500, 1965, 0, true) == InputEnd::kDone));
  CHECK((says(-2000, 1500, -1965, 1, true) == InputEnd::kDone));
  CHECK((says(2001, 0, 0, 0, true) == InputEnd::kHoldAttitude));
  CHECK((says(-2001, 0, 0, 0, true) == InputEnd::kHoldAttitude));
  CHECK((says(0, 1501, 0, 0, true) == InputEnd::kHoldAttitude));
  CHECK((says(0, -1501, 0, 0, true) == InputEnd::kHoldAttitude));
  for (uint8_t which = 0; which < 3; ++which) {
    CHECK((says(0, 0, 1966, which, true) == InputEnd::kHoldAttitude));
    CHECK((says(0, 0, INT16_MIN, which, true) == InputEnd::kHoldAttitude));
  }
  CHECK((says(0, 0, 0, 0, false) == InputEnd::kSensorLost));
}

TEST_CASE("it ends beyond 45 deg of bank or 25 of pitch, and where the attitude is no more") {
  Bench bench;
  bench.start();
  bench.in.phi = 4500;
  bench.in.theta = -2500;
  CHECK((bench.step() == InputEnd::kDone));
  bench.in.phi = -4501;
  CHECK((bench.step() == InputEnd::kBank));
  bench.in.phi = INT16_MIN;
  CHECK((bench.step() == InputEnd::kBank));
  bench.in.phi = 0;
  bench.in.theta = 2501;
  CHECK((bench.step() == InputEnd::kPitch));
  bench.in.theta = 0;
  bench.in.imu = false;
  CHECK((bench.step() == InputEnd::kSensorLost));
}

TEST_CASE("it ends where a held axis will be beyond within 0.16 s") {
  const auto says = [](uint8_t held, int16_t phi, int16_t p, int16_t theta, int16_t q) {
    Bench bench;
    bench.start(held);
    bench.in.phi = phi;
    bench.in.theta = theta;
    bench.in.rates[0] = p;
    bench.in.rates[1] = q;
    return bench.step();
  };
  CHECK((says(1, 3000, 6000, 0, 0) == InputEnd::kDone));
  CHECK((says(1, 3000, 6004, 0, 0) == InputEnd::kBank));
  CHECK((says(1, -3000, -6008, 0, 0) == InputEnd::kBank));
  CHECK((says(1, -3000, 32767, 0, 0) == InputEnd::kBank));
  CHECK((says(2, 3000, 6004, 0, 0) == InputEnd::kDone));  // the row itself may roll so
  CHECK((says(2, 0, 0, 1500, 4000) == InputEnd::kDone));
  CHECK((says(2, 0, 0, 1500, 4004) == InputEnd::kPitch));
  CHECK((says(1, 0, 0, 1500, 4004) == InputEnd::kDone));
}

TEST_CASE("a fourth sample that is alike to the bit in rates and forces ends it") {
  Bench bench;
  bench.start();
  for (uint8_t value = 0; value < 6; ++value) {
    CHECK((bench.step() == InputEnd::kDone));
    for (uint8_t round = 0; round < 3; ++round) {
      CHECK((bench.again() == InputEnd::kDone));
      CHECK((bench.again() == InputEnd::kDone));
      // One bit of one value is enough.
      int16_t& moved = value < 3 ? bench.in.rates[value] : bench.in.force[value - 3];
      moved = static_cast<int16_t>(moved ^ 1);
      CHECK((bench.again() == InputEnd::kDone));
    }
  }
  CHECK((bench.again() == InputEnd::kDone));
  CHECK((bench.again() == InputEnd::kDone));
  // What is computed from a gyro that stands goes on turning.
  bench.in.phi = 12;
  bench.in.theta = -7;
  CHECK((bench.again() == InputEnd::kSensorStill));
  CHECK((bench.again() == InputEnd::kSensorStill));
  CHECK((bench.step() == InputEnd::kDone));
}

TEST_CASE("a row does not begin on samples that are alike") {
  AttitudeHold hold = {};
  hold.load(gains(), kBoth, kRateUsps);
  InputReadings in = level();
  in.rates[0] = 1;
  for (uint8_t i = 1; i < AttitudeHold::kMostAlike; ++i) {
    CHECK((hold.may_start(in) == InputEnd::kDone));
  }
  CHECK((hold.may_start(in) == InputEnd::kSensorStill));
  in.rates[0] = 2;
  CHECK((hold.may_start(in) == InputEnd::kDone));
}

TEST_CASE("wings go level, pitch stays as it was at the trigger") {
  Bench bench;
  bench.in.phi = 400;
  bench.in.theta = 700;
  bench.start();
  for (uint8_t i = 0; i < 50; ++i) (void)bench.step();
  CHECK(bench.applied[0] < -70);
  CHECK_EQ(bench.applied[1], 0);
  CHECK_EQ(bench.applied[2], 0);
}

TEST_CASE("an axis that is not held is not touched") {
  Bench bench;
  bench.start(2);
  bench.applied[0] = 77;
  bench.in.phi = 1000;
  bench.in.theta = 1000;
  for (uint8_t i = 0; i < 50; ++i) (void)bench.step();
  CHECK_EQ(bench.applied[0], 77);
  CHECK(bench.applied[1] < -100);
}

TEST_CASE("the deflection follows no faster than the card's rate, whenever samples come") {
  Random random(50);
  const uint16_t rates[] = {100, 1000, 4000, 60000};
  for (const uint16_t rate : rates) {
    Bench bench;
    bench.start(kBoth, rate);
    uint32_t passed_us = 0;
    int16_t before = 0;
    uint32_t way = 0;
    for (uint16_t i = 0; i < 300; ++i) {
      const uint16_t rest_us = static_cast<uint16_t>(1000U + random.below(9000));
      bench.in.phi = between(random, -4500, 4500);
      (void)bench.step(rest_us);
      passed_us += rest_us;
      const int16_t moved = static_cast<int16_t>(bench.applied[0] - before);
      before = bench.applied[0];
      way += static_cast<uint32_t>(moved < 0 ? -moved : moved);
      CHECK(static_cast<double>(way) <= 2e-6 * rate * static_cast<double>(passed_us) + 1.0);
    }
    CHECK(way > 0);
  }
}

TEST_CASE("an error that grows for 0.5 s against the surface ends it") {
  Bench bench;
  bench.start();
  uint16_t samples = 0;
  InputEnd why = InputEnd::kDone;
  // 10 deg at once, then 20 deg/s: beyond half of the authority from the beginning.
  bench.in.phi = 1000;
  for (; why == InputEnd::kDone && samples < 400; ++samples) {
    bench.in.phi = static_cast<int16_t>(bench.in.phi + 10);
    why = bench.step();
  }
  CHECK((why == InputEnd::kHoldLoses));
  CHECK(samples >= 100);
  CHECK(samples <= 140);
}

TEST_CASE("an error that the surface masters, or that is small, ends nothing") {
  Bench bench;
  bench.start();
  // A gust: up for 0.4 s, back for 1 s, again and again.
  for (uint16_t i = 0; i < 2000; ++i) {
    const uint16_t phase = i % 280;
    bench.in.phi = static_cast<int16_t>(phase < 80 ? 20 * phase : 1600 - 8 * (phase - 80));
    CHECK((bench.step() == InputEnd::kDone));
  }
  Bench small;
  small.start();
  // It grows for 2 s, and the surface has not come to half of its authority.
  for (uint16_t i = 0; i < 400; ++i) {
    small.in.phi = static_cast<int16_t>(i / 2);
    CHECK((small.step() == InputEnd::kDone));
  }
}

TEST_CASE("sticks are still that stay where they were when it was armed") {
  AttitudeHold hold = {};
  core::RcChannels rc = {{3000, 2900, 3100, 2600, 3800}, 0x1F, 0x1F};
  hold.load(gains(), kBoth, kRateUsps);
  CHECK(!hold.sticks_still(rc, 40));
  hold.arm(rc);
  CHECK(hold.sticks_still(rc, 40));
  for (uint8_t i = 0; i < core::kServos; ++i) {
    core::RcChannels other = rc;
    other.width_ticks[i] = static_cast<uint16_t>(rc.width_ticks[i] + 80);
    CHECK(hold.sticks_still(other, 40));
    other.width_ticks[i] = static_cast<uint16_t>(rc.width_ticks[i] - 81);
    CHECK(!hold.sticks_still(other, 40));
  }
}

TEST_CASE("what card_hold must say") {
  const uint16_t amplitude_max_us[core::kCardAxes] = {200, 150, 0};
  frames::CardHoldLayout card = gains();
  CHECK(core::hold_good(card, amplitude_max_us));
  const auto refused = [&](auto change) {
    frames::CardHoldLayout other = gains();
    change(other);
    return !core::hold_good(other, amplitude_max_us);
  };
  for (uint8_t axis = 0; axis < core::kHeldAxes; ++axis) {
    CHECK(refused([=](frames::CardHoldLayout& c) { c.angle_gain[axis] = 0; }));
    CHECK(refused([=](frames::CardHoldLayout& c) { c.angle_gain[axis] = -1; }));
    CHECK(refused([=](frames::CardHoldLayout& c) { c.angle_gain[axis] = INT16_MIN; }));
    CHECK(refused([=](frames::CardHoldLayout& c) { c.integral_gain[axis] = -1; }));
    CHECK(refused([=](frames::CardHoldLayout& c) { c.rate_gain[axis] = -1; }));
    CHECK(refused([=](frames::CardHoldLayout& c) { c.authority_us[axis] = 0; }));
  }
  CHECK(refused([](frames::CardHoldLayout& c) { c.authority_us[0] = 201; }));
  CHECK(refused([](frames::CardHoldLayout& c) { c.authority_us[1] = 151; }));
  CHECK(refused([](frames::CardHoldLayout& c) { c.reserved[11] = 1; }));
}

#ifdef __AVR__
TEST_CASE("a sample of two held axes costs less than 0.15 ms") {
  Bench bench;
  bench.in.phi = 350;
  bench.in.theta = -250;
  bench.start();
  bench.in.rates[0] = 123;
  bench.in.theta = 321;
  TCCR1A = 0;
  TCCR1B = _BV(CS10);
  TCNT1 = 0;
  const InputEnd why = bench.step();
  const uint16_t cycles = TCNT1;
  CHECK((why == InputEnd::kDone));
  CHECK(cycles < 2400);
}
#endif
