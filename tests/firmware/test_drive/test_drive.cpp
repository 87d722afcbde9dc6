// Who drives, stepped every 5 ms with a clock of the test's own.
#include "check.h"
#include "core/drive.h"
#include "core/relay_watch.h"
#include "core/settings.h"
#include "random_numbers.h"

namespace {

using frames::Drive;

constexpr uint8_t kAll = 0b1'1111;
constexpr uint16_t kDirectUs = 1100;
constexpr uint16_t kMegaUs = 1900;

struct Bench {
  core::DriveControl drive;
  frames::ConfigFrame config;
  core::RcChannels rc = {{3000, 2900, 3100, 2000, 2 * kDirectUs}, kAll, kAll};
  bool self_test = true;
  uint32_t now_us = 0xFFFFFFFFU - 300000U;

  Bench() { core::default_settings(config); }

  void run_ms(uint16_t ms) {
    for (; ms >= 5; ms = static_cast<uint16_t>(ms - 5)) {
      now_us += 5000;
      drive.update(rc, config, self_test, now_us);
    }
  }
  void move_switch(uint16_t width_us) {
    rc.width_ticks[core::kSwitch] = static_cast<uint16_t>(2 * width_us);
  }
  void lose(uint8_t channels) {
    for (uint8_t i = 0; i < core::kChannels; ++i) {
      if ((channels >> i & 1) != 0) {
        rc.width_ticks[i] = 0;
      }
    }
    rc.steady = static_cast<uint8_t>(rc.steady & ~channels);
    rc.fresh = static_cast<uint8_t>(rc.fresh & ~channels);
  }
  void engage() {
    move_switch(kDirectUs);
    run_ms(200);
    move_switch(kMegaUs);
    run_ms(200);
  }
  bool is(Drive expected) const { return drive.drive() == expected; }
  bool silent() const {
    for (uint8_t i = 0; i < core::kServos; ++i) {
      if (drive.servo_ticks(i) != 0) {
        return false;
      }
    }
    return true;
  }
};

}  // namespace

TEST_CASE("at power-on the receiver drives and no pulse is sent") {
  Bench bench;
  CHECK(bench.is(Drive::kDirectBoot));
  CHECK(!bench.drive.relay());
  CHECK(bench.silent());
  bench.lose(kAll);
  bench.run_ms(1000);
  CHECK(bench.is(Drive::kDirectBoot));
  CHECK(bench.silent());
}

TEST_CASE("it engages only after direct, then Mega, each for 100 ms") {
  Bench bench;
  bench.run_ms(200);
  CHECK(bench.is(Drive::kDirectSwitch));
  bench.move_switch(kMegaUs);
  bench.run_ms(95);
  CHECK(!bench.drive.relay());
  bench.run_ms(20);
  CHECK(bench.is(Drive::kMega));
  CHECK(bench.drive.relay());
}

TEST_CASE("a switch that stands at Mega since boot engages nothing: a crash loop cannot chatter") {
  Bench bench;
  bench.move_switch(kMegaUs);
  bench.run_ms(10000);
  CHECK(bench.is(Drive::kDirectSwitch));
}

TEST_CASE("one glitch to direct does not arm") {
  Bench bench;
  bench.move_switch(kMegaUs);
  bench.run_ms(500);
  bench.move_switch(kDirectUs);
  bench.run_ms(60);
  bench.move_switch(kMegaUs);
  bench.run_ms(500);
  CHECK(!bench.drive.relay());
}

TEST_CASE("without self-test nothing engages, and losing it releases") {
  Bench bench;
  bench.self_test = false;
  bench.engage();
  CHECK(bench.is(Drive::kDirectSelfTest));
  bench.self_test = true;
  bench.run_ms(300);
  CHECK(!bench.drive.relay());
  bench.engage();
  REQUIRE(bench.drive.relay());
  bench.self_test = false;
  bench.run_ms(5);
  CHECK(bench.is(Drive::kDirectSelfTest));
}

TEST_CASE("the switch at direct, or between, releases at once and must be moved again") {
  const uint16_t places_us[] = {kDirectUs, 1500};
  for (const uint16_t place_us : places_us) {
    Bench bench;
    bench.engage();
    REQUIRE(bench.drive.relay());
    bench.move_switch(place_us);
    bench.run_ms(5);
    CHECK(bench.is(Drive::kDirectSwitch));
    bench.run_ms(50);
    bench.move_switch(kMegaUs);
    bench.run_ms(300);
    CHECK(!bench.drive.relay());
    bench.engage();
    CHECK(bench.drive.relay());
  }
}

TEST_CASE("outputs repeat their own channel, engaged or not") {
  Bench bench;
  bench.run_ms(5);
  CHECK_EQ(bench.drive.servo_ticks(core::kAileron), 3000);
  CHECK_EQ(bench.drive.servo_ticks(core::kThrottle), 2000);
  bench.engage();
  bench.rc.width_ticks[core::kElevator] = 3333;
  bench.run_ms(5);
  CHECK_EQ(bench.drive.servo_ticks(core::kElevator), 3333);
  CHECK_EQ(bench.drive.servo_ticks(core::kRudder), 3100);
}

TEST_CASE("a channel that is not steady sends nothing") {
  Bench bench;
  bench.rc.steady = 0b1'1110;
  bench.run_ms(50);
  CHECK_EQ(bench.drive.servo_ticks(core::kAileron), 0);
  CHECK_EQ(bench.drive.servo_ticks(core::kElevator), 2900);
}

TEST_CASE("any driven channel lost releases in the same turn, and its output falls silent") {
  for (uint8_t channel = 0; channel < core::kServos; ++channel) {
    Bench bench;
    bench.engage();
    REQUIRE(bench.drive.relay());
    bench.lose(static_cast<uint8_t>(1U << channel));
    bench.run_ms(5);
    CHECK(bench.is(Drive::kDirectReceiverLost));
    CHECK_EQ(bench.drive.missing(), 1U << channel);
    CHECK_EQ(bench.drive.servo_ticks(channel), 0);
  }
}

TEST_CASE("receiver lost: released, silent, and armed again only through direct") {
  Bench bench;
  bench.engage();
  bench.lose(kAll);
  bench.run_ms(5);
  CHECK(bench.is(Drive::kDirectReceiverLost));
  CHECK(bench.silent());
  bench.rc = {{3000, 2900, 3100, 2000, 2 * kMegaUs}, kAll, kAll};
  bench.run_ms(2000);
  CHECK(!bench.drive.relay());
  bench.engage();
  CHECK(bench.drive.relay());
}

TEST_CASE("a direct seen before the receiver was lost does not count behind it") {
  Bench bench;
  bench.run_ms(300);
  bench.lose(kAll);
  bench.run_ms(50);
  bench.rc = {{3000, 2900, 3100, 2000, 2 * kMegaUs}, kAll, kAll};
  bench.run_ms(500);
  CHECK(!bench.drive.relay());
}

TEST_CASE("the switch alone lost counts as direct, hold or not") {
  const uint16_t holds_ms[] = {0, 1000};
  for (const uint16_t hold_ms : holds_ms) {
    Bench bench;
    bench.config.hold_ms = hold_ms;
    bench.engage();
    REQUIRE(bench.drive.relay());
    bench.lose(1U << core::kSwitch);
    bench.run_ms(5);
    CHECK(bench.is(Drive::kDirectSwitchInvalid));
  }
}

TEST_CASE("steady preset pulses with the switch below 950 us are a lost receiver") {
  Bench bench;
  bench.engage();
  bench.move_switch(900);
  bench.run_ms(5);
  CHECK(bench.is(Drive::kDirectReceiverLost));
  CHECK_EQ(bench.drive.missing(), 0);
  bench.run_ms(500);
  bench.move_switch(kMegaUs);
  bench.run_ms(500);
  CHECK(!bench.drive.relay());
}

TEST_CASE("hold keeps surfaces for its time, never throttle, then releases") {
  Bench bench;
  bench.config.hold_ms = 400;
  bench.engage();
  REQUIRE(bench.drive.relay());
  bench.lose(kAll);
  bench.run_ms(5);
  CHECK(bench.is(Drive::kMegaHolding));
  CHECK_EQ(bench.drive.servo_ticks(core::kAileron), 3000);
  CHECK_EQ(bench.drive.servo_ticks(core::kElevator), 2900);
  CHECK_EQ(bench.drive.servo_ticks(core::kRudder), 3100);
  CHECK_EQ(bench.drive.servo_ticks(core::kThrottle), 0);
  bench.run_ms(395);
  CHECK(bench.drive.relay());
  bench.run_ms(10);
  CHECK(bench.is(Drive::kDirectReceiverLost));
  CHECK(bench.silent());
}

TEST_CASE("the switch first in the frame times out first: that is a lost receiver, and holds") {
  Bench bench;
  bench.config.hold_ms = 400;
  bench.engage();
  bench.rc.fresh = 0;
  bench.rc.width_ticks[core::kSwitch] = 0;
  bench.rc.steady = 0b0'1111;
  bench.run_ms(5);
  CHECK(bench.is(Drive::kMegaHolding));
}

TEST_CASE("pulses that return during a hold end it; the switch at direct ends it too") {
  Bench bench;
  bench.config.hold_ms = 1000;
  bench.engage();
  bench.lose(kAll);
  bench.run_ms(100);
  bench.rc = {{3200, 2900, 3100, 2000, 2 * kMegaUs}, kAll, 0};
  bench.run_ms(20);
  CHECK(bench.is(Drive::kMegaHolding));
  CHECK_EQ(bench.drive.servo_ticks(core::kAileron), 3000);
  bench.rc.steady = kAll;
  bench.run_ms(5);
  CHECK(bench.is(Drive::kMega));
  CHECK_EQ(bench.drive.servo_ticks(core::kAileron), 3200);
  bench.lose(kAll);
  bench.run_ms(100);
  bench.move_switch(kDirectUs);
  bench.run_ms(5);
  CHECK(bench.is(Drive::kDirectSwitch));
}

TEST_CASE("receiver inputs reach the channels that the settings name") {
  core::RcDecoder decoder;
  frames::ConfigFrame config;
  core::default_settings(config);
  config.input_aileron = 1;
  config.input_elevator = 0;
  config.input_switch = 9;  // never: settings are checked, but an index must stay in bounds
  uint32_t now = 0;
  decoder.edge(now, 0, false);
  for (uint8_t i = 0; i < 4; ++i) {
    now += 40000;
    decoder.edge(now, 0b11, false);
    decoder.edge(now + 2400, 0b01, false);
    decoder.edge(now + 3600, 0b00, false);
    decoder.poll(now + 8000);
  }
  core::RcChannels rc;
  core::map_channels(decoder, config, rc);
  CHECK_EQ(rc.width_ticks[core::kAileron], 2400);
  CHECK_EQ(rc.width_ticks[core::kElevator], 3600);
  CHECK_EQ(rc.width_ticks[core::kSwitch], 0);
  CHECK_EQ(rc.steady, 0b0'0011);
  CHECK_EQ(rc.fresh, 0b0'0011);
}

TEST_CASE("random losses and switch moves: every output is live, or a held surface, or silent") {
  uint32_t random = 6;
  Bench bench;
  bench.config.hold_ms = 300;
  uint16_t wrong = 0;
  uint16_t engaged = 0;
  uint16_t last[core::kServos] = {};
  bool armed = false;  // the switch was at direct since the last release
  for (uint16_t turn = 0; turn < 6000; ++turn) {
    next_random(random);
    const uint8_t dice = static_cast<uint8_t>(random >> 24);
    if (dice < 6) {
      bench.lose(static_cast<uint8_t>(random >> 16 & kAll));
    } else if (dice < 30) {
      const uint16_t at = bench.rc.width_ticks[core::kSwitch];
      bench.rc = {{3000, 2900, 3100, 2000, at == 0 ? uint16_t{2 * kMegaUs} : at}, kAll, kAll};
    } else if (dice < 50) {
      bench.move_switch(dice < 40 ? kDirectUs : kMegaUs);
      bench.rc.steady = kAll;
      bench.rc = {{3000, 2900, 3100, 2000, bench.rc.width_ticks[core::kSwitch]}, kAll, kAll};
    }
    const bool before = bench.drive.relay();
    bench.run_ms(25);
    armed = armed || bench.rc.width_ticks[core::kSwitch] == 2 * kDirectUs;
    if (bench.drive.relay() && !before) {
      ++engaged;
      wrong = static_cast<uint16_t>(wrong + (armed ? 0 : 1));
    }
    if (before && !bench.drive.relay()) {
      armed = bench.rc.width_ticks[core::kSwitch] == 2 * kDirectUs;
    }
    for (uint8_t i = 0; i < core::kServos; ++i) {
      const uint16_t out = bench.drive.servo_ticks(i);
      const bool live = (bench.rc.steady >> i & 1) != 0 && out == bench.rc.width_ticks[i];
      const bool held = bench.is(Drive::kMegaHolding) && i != core::kThrottle && out == last[i];
      wrong = static_cast<uint16_t>(wrong + (live || held || out == 0 ? 0 : 1));
      last[i] = out;
    }
  }
  CHECK_EQ(wrong, 0);
  CHECK(engaged > 20);
}

TEST_CASE(
    "a relay that does not follow goes to the receiver until the switch sequence comes again") {
  Bench bench;
  bench.engage();
  CHECK(bench.is(Drive::kMega));
  bench.drive.relay_lost();
  CHECK(!bench.drive.relay());
  bench.run_ms(5000);  // the switch still says Mega
  CHECK(bench.is(Drive::kDirectRelay));
  bench.engage();
  CHECK(bench.is(Drive::kMega));
}

namespace {

using core::RelayFault;

// A relay that follows the edges as the data sheet says, looked at every turn of the main loop.
struct RelayBench {
  core::RelayWatch watch;
  Random random{7};
  uint32_t now_us = 0xFFFFFFFFU - 2000000U;

  RelayFault look_us(uint32_t for_us, bool closed) {
    RelayFault fault = RelayFault::kNone;
    for (const uint32_t end_us = now_us + for_us; fault == RelayFault::kNone && end_us != now_us;) {
      const uint32_t left_us = end_us - now_us;
      const uint16_t turn_us = static_cast<uint16_t>(700 + random.below(1600));
      now_us += turn_us < left_us ? turn_us : left_us;
      fault = watch.look(closed, now_us);
    }
    return fault;
  }
};

}  // namespace

TEST_CASE("a relay that never pulls in is lost 50 ms behind the first edge, not before") {
  RelayBench bench;
  CHECK(bench.look_us(49000, false) == RelayFault::kNone);
  CHECK(bench.look_us(6000, false) == RelayFault::kNeverEngaged);
}

TEST_CASE("a relay that drops is lost within 25 ms, one that bounces is not") {
  RelayBench bench;
  bench.look_us(5000, false);
  CHECK(bench.look_us(1000000, true) == RelayFault::kNone);
  for (uint8_t i = 0; i < 100; ++i) {
    CHECK(bench.look_us(15000, false) == RelayFault::kNone);
    CHECK(bench.look_us(1000, true) == RelayFault::kNone);
  }
  const uint32_t opened_us = bench.now_us;
  CHECK(bench.look_us(30000, false) == RelayFault::kOpened);
  CHECK(bench.now_us - opened_us <= 25000);
}

TEST_CASE("looks that are far apart say nothing of the time between") {
  core::RelayWatch watch;
  CHECK(watch.look(true, 1000) == RelayFault::kNone);
  CHECK(watch.look(false, 2000) == RelayFault::kNone);
  CHECK(watch.look(false, 90000) == RelayFault::kNone);
  CHECK(watch.look(false, 91000) == RelayFault::kNone);
}

TEST_CASE("1000 engagements in a row with 1 ms of bounce never trip it") {
  RelayBench bench;
  for (uint16_t i = 0; i < 1000; ++i) {
    RelayFault fault = bench.look_us(3000UL + bench.random.below(7000), false);
    for (uint8_t bounce = 0; bounce < 3 && fault == RelayFault::kNone; ++bounce) {
      fault = bench.look_us(300, (bounce & 1U) == 0);
    }
    if (fault == RelayFault::kNone) {
      fault = bench.look_us(100000, true);
    }
    CHECK(fault == RelayFault::kNone);
    bench.watch.rest();
    bench.now_us += uint32_t{1000} * bench.random.below(400);
  }
}

TEST_CASE("the relay's times to the microsecond, and the numbers of its event") {
  CHECK_EQ(static_cast<uint8_t>(RelayFault::kNeverEngaged), 0);
  CHECK_EQ(static_cast<uint8_t>(RelayFault::kOpened), 1);
  const uint32_t starts_us[] = {5000000, 0xFFFFFFFFU - 30000U};  // over the wrap too
  for (const uint32_t start_us : starts_us) {
    core::RelayWatch never;
    for (uint32_t t_us = 0; t_us <= 45000; t_us += 9000) {
      CHECK(never.look(false, start_us + t_us) == RelayFault::kNone);
    }
    CHECK(never.look(false, start_us + 49999) == RelayFault::kNone);
    CHECK(never.look(false, start_us + 50000) == RelayFault::kNeverEngaged);
    core::RelayWatch opened;
    CHECK(opened.look(true, start_us) == RelayFault::kNone);
    CHECK(opened.look(false, start_us + 1000) == RelayFault::kNone);
    CHECK(opened.look(false, start_us + 11000) == RelayFault::kNone);  // 10 ms: not blind yet
    CHECK(opened.look(false, start_us + 20999) == RelayFault::kNone);
    CHECK(opened.look(false, start_us + 21000) == RelayFault::kOpened);
    core::RelayWatch blind;
    CHECK(blind.look(true, start_us) == RelayFault::kNone);
    CHECK(blind.look(false, start_us + 1000) == RelayFault::kNone);
    CHECK(blind.look(false, start_us + 11001) == RelayFault::kNone);  // a microsecond more: blind
    CHECK(blind.look(false, start_us + 21001) == RelayFault::kNone);
    CHECK(blind.look(false, start_us + 31000) == RelayFault::kNone);
    CHECK(blind.look(false, start_us + 31001) == RelayFault::kOpened);
    // Closed once, it is open from the next look on anew.
    core::RelayWatch bounced;
    bounced.look(true, start_us);
    bounced.look(false, start_us + 1000);
    bounced.look(false, start_us + 10000);
    CHECK(bounced.look(true, start_us + 19000) == RelayFault::kNone);
    CHECK(bounced.look(false, start_us + 20000) == RelayFault::kNone);
    CHECK(bounced.look(false, start_us + 30000) == RelayFault::kNone);
    CHECK(bounced.look(false, start_us + 39999) == RelayFault::kNone);
    CHECK(bounced.look(false, start_us + 40000) == RelayFault::kOpened);
    // A rest ends the watch: the next look is at a first edge again.
    bounced.rest();
    CHECK(bounced.look(false, start_us + 41000) == RelayFault::kNone);
    for (uint32_t t_us = 50000; t_us <= 90000; t_us += 10000) {
      CHECK(bounced.look(false, start_us + t_us) == RelayFault::kNone);
    }
    CHECK(bounced.look(false, start_us + 90999) == RelayFault::kNone);
    CHECK(bounced.look(false, start_us + 91000) == RelayFault::kNeverEngaged);
  }
  // The first look of a flight has nothing before it, whatever the clock says.
  for (uint32_t first_us = 0; first_us < 4; ++first_us) {
    core::RelayWatch watch;
    CHECK(watch.look(true, first_us) == RelayFault::kNone);
    CHECK(watch.look(false, first_us + 1) == RelayFault::kNone);
    CHECK(watch.look(false, first_us + 10001) == RelayFault::kNone);
    CHECK(watch.look(false, first_us + 20000) == RelayFault::kNone);
    CHECK(watch.look(false, first_us + 20001) == RelayFault::kOpened);
  }
}
