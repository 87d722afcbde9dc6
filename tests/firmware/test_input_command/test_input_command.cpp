// Who is in command: the table of core/README.md, line by line, then random pilots against it.
#include "check.h"
#include "core/input_command.h"
#include "core/test_input.h"
#include "random_numbers.h"

namespace {

using core::InputCommand;
using core::InputFacts;
using core::InputMemory;
using core::SwitchPlace;
using frames::InputEnd;
using State = InputCommand::State;

constexpr uint16_t kMegaMinUs = 1600;
constexpr uint16_t kArmedMinUs = 1850;
constexpr uint16_t kRateUsps = 4000;

struct Bench {
  InputCommand command;
  InputMemory memory = {};
  core::RcChannels rc = {{3000, 2900, 3100, 2600, 3800}, 0x1F, 0x1F};
  InputFacts facts = {};
  uint32_t now_us = 0xFFFFFFFFU - 2000000U;
  InputEnd ended = InputEnd::kDone;
  uint8_t ends = 0;
  uint8_t starts = 0;

  Bench() {
    memory.row.shape = static_cast<uint8_t>(frames::CardShape::kDoublet);
    memory.row.axes = 2;
    memory.row.quiet_ms = 100;
    memory.row.duration_ms = 1000;
    memory.row.amplitude_us[1] = 100;
    memory.rate_max_usps = kRateUsps;
    facts.drive = frames::Drive::kMega;
    facts.place = SwitchPlace::kOther;
    facts.frame_us = 20000;
    facts.silent_us = 10000;
    facts.stick_us = 40;
    facts.contact = facts.flying = facts.supply = facts.records = true;
    command.enable();
  }

  void look(uint16_t rest_us = 5000) {
    now_us += rest_us;
    facts.rc = &rc;
    if (!command.running()) {
      if (!command.trigger(facts.place, facts.drive == frames::Drive::kMega, now_us)) return;
      if (InputCommand::passes(facts) == InputEnd::kDone) {
        command.start(memory, facts, now_us);
        ++starts;
      } else {
        command.refuse();
      }
      return;
    }
    const InputEnd why = command.keeps(memory, facts, now_us);
    if (why == InputEnd::kDone && !command.over(memory, now_us)) {
      command.steer(memory, now_us);
      return;
    }
    ended = why;
    ++ends;
    command.end(3);
  }
  void run(SwitchPlace place, uint16_t ms) {
    facts.place = place;
    for (; ms >= 5; ms = static_cast<uint16_t>(ms - 5)) look();
  }
  // Running, its quiet time over, the deflection in force.
  void fly() {
    run(SwitchPlace::kMega, 600);
    run(SwitchPlace::kArmed, 500);
    REQUIRE(command.running());
  }
  bool is(State state) const { return command.state() == state; }
};

}  // namespace

TEST_CASE("places of the switch, and none where armed is switched off") {
  const auto place = [](uint16_t us, uint16_t armed_us) {
    return core::switch_place(static_cast<uint16_t>(2 * us), kMegaMinUs, armed_us);
  };
  CHECK((place(1599, kArmedMinUs) == SwitchPlace::kOther));
  CHECK((place(1600, kArmedMinUs) == SwitchPlace::kMega));
  CHECK((place(1750, kArmedMinUs) == SwitchPlace::kMega));
  CHECK((place(1751, kArmedMinUs) == SwitchPlace::kBetween));
  CHECK((place(1849, kArmedMinUs) == SwitchPlace::kBetween));
  CHECK((place(1850, kArmedMinUs) == SwitchPlace::kArmed));
  CHECK((place(2200, kArmedMinUs) == SwitchPlace::kArmed));
  CHECK((place(0, kArmedMinUs) == SwitchPlace::kOther));
  CHECK((place(2000, 0) == SwitchPlace::kOther));
}

TEST_CASE("0.5 s at Mega, then 0.3 s at armed: one input") {
  Bench bench;
  bench.run(SwitchPlace::kMega, 500);
  CHECK(bench.is(State::kAtMega));
  bench.run(SwitchPlace::kMega, 5);
  CHECK(bench.is(State::kReady));
  bench.run(SwitchPlace::kArmed, 300);
  CHECK(bench.is(State::kAtArmed));
  bench.run(SwitchPlace::kArmed, 5);
  CHECK(bench.is(State::kRunning));
  CHECK_EQ(bench.command.row(), 0);
  bench.run(SwitchPlace::kArmed, 1095);
  CHECK(bench.is(State::kRunning));
  bench.run(SwitchPlace::kArmed, 5);
  CHECK(bench.is(State::kSpent));
  CHECK((bench.ended == InputEnd::kDone));
  bench.run(SwitchPlace::kArmed, 20000);
  CHECK_EQ(bench.starts, 1);
}

TEST_CASE("arriving at armed by itself triggers nothing") {
  Bench bench;
  bench.run(SwitchPlace::kArmed, 5000);
  CHECK(bench.is(State::kSpent));
  bench.run(SwitchPlace::kOther, 5000);
  bench.run(SwitchPlace::kArmed, 5000);
  CHECK(bench.is(State::kSpent));
  bench.run(SwitchPlace::kMega, 490);
  bench.run(SwitchPlace::kArmed, 5000);
  CHECK(bench.is(State::kSpent));
  CHECK_EQ(bench.starts, 0);
}

TEST_CASE("each row needs its own trigger, and behind the last comes the first") {
  Bench bench;
  for (uint8_t n = 0; n < 5; ++n) {
    CHECK_EQ(bench.command.row(), n % 3);
    bench.run(SwitchPlace::kMega, 600);
    bench.run(SwitchPlace::kArmed, 4000);
    CHECK_EQ(bench.starts, n + 1);
  }
}

TEST_CASE("a break in Mega or in armed begins anew") {
  Bench bench;
  bench.run(SwitchPlace::kMega, 400);
  bench.run(SwitchPlace::kOther, 5);
  bench.run(SwitchPlace::kMega, 400);
  bench.run(SwitchPlace::kArmed, 400);
  CHECK_EQ(bench.starts, 0);
  bench.run(SwitchPlace::kMega, 600);
  bench.run(SwitchPlace::kArmed, 200);
  bench.run(SwitchPlace::kBetween, 5);
  bench.run(SwitchPlace::kArmed, 400);
  CHECK_EQ(bench.starts, 0);
  bench.run(SwitchPlace::kMega, 600);
  bench.run(SwitchPlace::kArmed, 200);
  bench.run(SwitchPlace::kMega, 200);
  bench.run(SwitchPlace::kArmed, 400);
  CHECK_EQ(bench.starts, 0);
}

TEST_CASE("a slow switch may pass between Mega and armed, not before Mega counted") {
  Bench bench;
  bench.run(SwitchPlace::kMega, 600);
  bench.run(SwitchPlace::kBetween, 50);
  bench.run(SwitchPlace::kArmed, 400);
  CHECK_EQ(bench.starts, 1);
  Bench hasty;
  hasty.run(SwitchPlace::kMega, 300);
  hasty.run(SwitchPlace::kBetween, 300);
  hasty.run(SwitchPlace::kArmed, 400);
  CHECK_EQ(hasty.starts, 0);
}

TEST_CASE("without the Mega driving nothing counts") {
  Bench bench;
  bench.facts.drive = frames::Drive::kDirectSwitch;
  bench.run(SwitchPlace::kMega, 600);
  CHECK(bench.is(State::kWaiting));
  bench.facts.drive = frames::Drive::kMega;
  bench.run(SwitchPlace::kMega, 300);
  bench.facts.drive = frames::Drive::kMegaHolding;
  bench.run(SwitchPlace::kMega, 5);
  CHECK(bench.is(State::kWaiting));
}

TEST_CASE("never before it is enabled, and no more behind it is disabled") {
  Bench bench;
  bench.command.disable();
  bench.run(SwitchPlace::kMega, 600);
  bench.run(SwitchPlace::kArmed, 600);
  CHECK(bench.is(State::kOff));
  InputCommand fresh;
  CHECK(!fresh.enabled());
}

TEST_CASE("what stands against a trigger refuses it, and the switch must come again") {
  const auto refused = [](void (*change)(Bench&)) {
    Bench bench;
    bench.run(SwitchPlace::kMega, 600);
    change(bench);
    bench.run(SwitchPlace::kArmed, 400);
    const bool none = bench.starts == 0;
    return none && bench.is(State::kSpent);
  };
  CHECK(refused([](Bench& b) { b.facts.button = true; }));
  CHECK(refused([](Bench& b) { b.rc.steady = 0x0F; }));
  CHECK(refused([](Bench& b) { b.facts.frame_us = 0; }));
  CHECK(refused([](Bench& b) { b.facts.silent_us = 30001; }));
  CHECK(refused([](Bench& b) { b.facts.flying = false; }));
  CHECK(refused([](Bench& b) { b.facts.supply = false; }));
  CHECK(refused([](Bench& b) { b.facts.records = false; }));
  CHECK(refused([](Bench& b) { b.facts.throttle_idle = true; }));
  CHECK(!refused([](Bench& b) { b.facts.silent_us = 30000; }));
}

TEST_CASE("each reason ends it in the look that knows it") {
  struct Case {
    void (*change)(Bench&);
    InputEnd why;
  };
  const Case cases[] = {
      {[](Bench& b) { b.rc.width_ticks[0] = 3000 + 81; }, InputEnd::kStick},
      {[](Bench& b) { b.rc.width_ticks[1] = 2900 - 81; }, InputEnd::kStick},
      {[](Bench& b) { b.rc.width_ticks[2] = 3100 + 81; }, InputEnd::kStick},
      {[](Bench& b) { b.rc.width_ticks[3] = 2600 - 81; }, InputEnd::kStick},
      {[](Bench& b) { b.facts.place = SwitchPlace::kBetween; }, InputEnd::kSwitch},
      {[](Bench& b) { b.facts.place = SwitchPlace::kMega; }, InputEnd::kSwitch},
      {[](Bench& b) { b.facts.place = SwitchPlace::kOther; }, InputEnd::kSwitch},
      {[](Bench& b) { b.rc.steady = 0x1D; }, InputEnd::kReceiver},
      {[](Bench& b) { b.facts.silent_us = 30001; }, InputEnd::kReceiver},
      {[](Bench& b) { b.facts.frame_us = 0; }, InputEnd::kFrameTime},
      {[](Bench& b) { b.facts.frame_us = 22501; }, InputEnd::kFrameTime},
      {[](Bench& b) { b.facts.frame_us = 17499; }, InputEnd::kFrameTime},
      {[](Bench& b) { b.facts.frame_us = 9000; }, InputEnd::kFrameTime},
      {[](Bench& b) { b.facts.frame_us = 41000; }, InputEnd::kFrameTime},
      {[](Bench& b) { b.facts.drive = frames::Drive::kDirectSelfTest; }, InputEnd::kDrive},
      {[](Bench& b) { b.facts.drive = frames::Drive::kMegaHolding; }, InputEnd::kDrive},
      {[](Bench& b) { b.facts.drive = frames::Drive::kDirectRelay; }, InputEnd::kDrive},
      {[](Bench& b) { b.facts.flying = false; }, InputEnd::kNotFlying},
      {[](Bench& b) { b.facts.supply = false; }, InputEnd::kSupply},
      {[](Bench& b) { b.facts.records = false; }, InputEnd::kRecorder},
      {[](Bench& b) { b.facts.dropped = 1; }, InputEnd::kDropped},
      {[](Bench& b) { b.facts.button = true; }, InputEnd::kButton},
      {[](Bench& b) { b.facts.throttle_idle = true; }, InputEnd::kThrottleIdle},
      {[](Bench& b) { b.now_us += 14000; }, InputEnd::kLoopLate},
  };
  for (const Case& one : cases) {
    Bench bench;
    bench.fly();
    one.change(bench);
    bench.look();
    CHECK(!bench.command.running());
    CHECK_EQ(static_cast<int>(bench.ended), static_cast<int>(one.why));
  }
}

TEST_CASE("times count whatever the looks are, from zero on and where the clock comes round") {
  Bench early;
  early.now_us = 0;
  const auto looks = [&](SwitchPlace place, uint32_t until_us) {
    early.facts.place = place;
    while (early.now_us < until_us) early.look(7000);
  };
  looks(SwitchPlace::kMega, 600000);
  CHECK(early.is(State::kReady));
  looks(SwitchPlace::kArmed, 1000000);
  CHECK(early.is(State::kRunning));
  looks(SwitchPlace::kArmed, 2400000);
  CHECK(early.is(State::kSpent));
  Bench late;
  late.now_us = 0xFFFFFFFFU - 800000U;  // armed 0.2 s before
  late.run(SwitchPlace::kMega, 600);
  late.run(SwitchPlace::kArmed, 310);
  CHECK(late.is(State::kRunning));
}

TEST_CASE("a switch that was elsewhere on its way from Mega triggers nothing") {
  Bench bench;
  bench.run(SwitchPlace::kMega, 600);
  bench.run(SwitchPlace::kOther, 5);
  CHECK(bench.is(State::kWaiting));
  bench.run(SwitchPlace::kArmed, 1000);
  CHECK_EQ(bench.starts, 0);
}

TEST_CASE("a row that runs is triggered by nothing") {
  Bench bench;
  bench.fly();
  CHECK(!bench.command.trigger(SwitchPlace::kArmed, true, bench.now_us));
  CHECK(bench.command.running());
}

TEST_CASE("what was dropped before the trigger ends nothing, a count that came round does") {
  Bench bench;
  bench.facts.dropped = 7;
  bench.fly();
  bench.look();
  REQUIRE(bench.command.running());
  bench.facts.dropped = 3;
  bench.look();
  CHECK_EQ(static_cast<int>(bench.ended), static_cast<int>(InputEnd::kDropped));
}

TEST_CASE("steered in whole milliseconds, each counted once, at the rate and no faster") {
  Bench bench;
  bench.memory.row.quiet_ms = 30;
  bench.memory.row.axes = 7;
  for (uint8_t axis = 0; axis < core::kCardAxes; ++axis) bench.memory.row.amplitude_us[axis] = 200;
  bench.facts.rc = &bench.rc;
  const uint32_t from_us = 65000;
  bench.command.start(bench.memory, bench.facts, from_us);
  CHECK_EQ(bench.memory.turns, core::turns_per_ms(bench.memory.row));
  const auto steer = [&](uint32_t behind_us) {
    bench.command.steer(bench.memory, from_us + behind_us);
    return static_cast<uint16_t>(bench.memory.steered_us - from_us);
  };
  CHECK_EQ(steer(InputCommand::kSteerUs - 1), 0);
  CHECK_EQ(steer(InputCommand::kSteerUs), 15000);
  CHECK_EQ(bench.memory.elapsed_ms, 15);
  CHECK_EQ(bench.memory.applied_ticks[0], 0);
  CHECK_EQ(steer(30999), 30000);  // its quiet time is over
  CHECK_EQ(bench.memory.elapsed_ms, 30);
  for (const int16_t ticks : bench.memory.applied_ticks) {
    CHECK(ticks <= 120);  // 15 ms of 4000 us/s
    CHECK(ticks >= 119);
  }
  CHECK_EQ(steer(31999), 30000);
  for (uint8_t n = 3; n < 20; ++n) {
    CHECK_EQ(steer(15000UL * n), static_cast<uint16_t>(15000UL * n));
    CHECK_EQ(bench.memory.elapsed_ms, 15 * n);
  }
  CHECK(!bench.command.over(bench.memory, from_us + 1029999UL));
  CHECK(bench.command.over(bench.memory, from_us + 1030000UL));
}

TEST_CASE("behind the last row comes the first, of a shorter card too") {
  InputCommand command;
  command.end(3);
  command.end(3);
  CHECK_EQ(command.row(), 2);
  command.end(1);
  CHECK_EQ(command.row(), 0);
}

TEST_CASE("what is within its tolerance ends nothing") {
  Bench bench;
  bench.fly();
  bench.rc.width_ticks[0] = 3080;
  bench.rc.width_ticks[3] = 2520;
  bench.facts.frame_us = 22500;
  bench.facts.silent_us = 33750;
  bench.look(18000);
  bench.facts.contact = false;
  bench.look();
  CHECK(bench.command.running());
  bench.facts.contact = true;
  bench.look();
  bench.facts.contact = false;
  bench.look();
  CHECK(bench.command.running());
  bench.look();
  CHECK_EQ(static_cast<int>(bench.ended), static_cast<int>(InputEnd::kRelay));
}

TEST_CASE("the deflection follows the shape no faster than the rate") {
  Bench bench;
  bench.fly();  // 195 ms behind the trigger, 95 behind the beginning
  CHECK_EQ(bench.memory.applied_ticks[1], 200);
  CHECK_EQ(bench.memory.applied_ticks[0], 0);
  bench.run(SwitchPlace::kArmed, 400);
  CHECK_EQ(bench.memory.applied_ticks[1], 200);
  int16_t before = 200;
  for (uint8_t n = 0; n < 40; ++n) {
    bench.look();
    CHECK(before - bench.memory.applied_ticks[1] <= 120);  // 15 ms of 4000 us/s
    before = bench.memory.applied_ticks[1];
  }
  CHECK_EQ(before, -200);
}

TEST_CASE("a row begins with nothing of the one before it") {
  Bench bench;
  for (int16_t& ticks : bench.memory.applied_ticks) ticks = 77;
  bench.memory.open_looks = 1;
  bench.memory.elapsed_ms = 900;
  bench.run(SwitchPlace::kMega, 600);
  while (!bench.command.running()) bench.run(SwitchPlace::kArmed, 5);
  for (const int16_t ticks : bench.memory.applied_ticks) CHECK_EQ(ticks, 0);
  CHECK_EQ(bench.memory.open_looks, 0);
  CHECK_EQ(bench.memory.elapsed_ms, 0);
  bench.facts.contact = false;
  bench.look();
  CHECK(bench.command.running());
}

TEST_CASE("in its quiet time nothing is deflected") {
  Bench bench;
  bench.run(SwitchPlace::kMega, 600);
  bench.run(SwitchPlace::kArmed, 400);
  REQUIRE(bench.command.running());
  CHECK_EQ(bench.memory.applied_ticks[1], 0);
}

TEST_CASE("a deflection is cut at the travel, and a stick beyond it is left alone") {
  CHECK_EQ(core::add_up_to(3000, 200, 3600), 3200);
  CHECK_EQ(core::add_up_to(3500, 200, 3600), 3600);
  CHECK_EQ(core::add_up_to(3700, 200, 3600), 3700);
  CHECK_EQ(core::add_up_to(4400, 1000, 4400), 4400);
  CHECK_EQ(core::add_up_to(3000, 200, 1600), 3000);  // no travel was shown
  CHECK_EQ(core::add_down_to(3000, -200, 2400), 2800);
  CHECK_EQ(core::add_down_to(2500, -200, 2400), 2400);
  CHECK_EQ(core::add_down_to(2300, -200, 2400), 2300);
  CHECK_EQ(core::add_down_to(1600, -1000, 1600), 1600);
  CHECK_EQ(core::add_down_to(3000, -200, 4400), 3000);
}

// Against a book of its own: when was the switch where, and did anything stand against it?
TEST_CASE("random pilots: one trigger is one input of its own length, ended when it must be") {
  Random random(30005);
  for (uint8_t pilot = 0; pilot < 30; ++pilot) {
    Bench bench;
    uint16_t mega_ms = 0;
    uint16_t armed_ms = 0;
    uint16_t left = 0;
    bool counted = false;  // 0.5 s at Mega, and nothing but armed (or on the way) since
    SwitchPlace place = SwitchPlace::kOther;
    for (uint16_t n = 0; n < 3000; ++n) {
      if (left == 0) {
        left = static_cast<uint16_t>(1 + random.below(random.byte() < 60 ? 10 : 250));
        place = static_cast<SwitchPlace>(random.below(4));
        if (random.byte() < 100) place = counted ? SwitchPlace::kArmed : SwitchPlace::kMega;
      }
      --left;
      const bool against = random.byte() == 0 && random.byte() < 64;
      bench.facts.button = against;
      const bool was_running = bench.command.running();
      const uint8_t starts = bench.starts;
      bench.facts.place = place;
      bench.look();
      if (was_running) {
        if (place != SwitchPlace::kArmed || against) CHECK(!bench.command.running());
        if (bench.command.running()) CHECK(bench.now_us - bench.command.since_us() < 1100000U);
      }
      if (bench.starts != starts) {
        CHECK(counted);
        CHECK(armed_ms >= 300);
        CHECK(!against);
        CHECK((place == SwitchPlace::kArmed));
      }
      if (place == SwitchPlace::kMega) {
        if (armed_ms != 0) mega_ms = 0;
        mega_ms = static_cast<uint16_t>(mega_ms + (mega_ms < 60000U ? 5 : 0));
        armed_ms = 0;
        counted = mega_ms > 500;
      } else if (place == SwitchPlace::kArmed) {
        armed_ms = static_cast<uint16_t>(armed_ms + (armed_ms < 60000U ? 5 : 0));
        mega_ms = 0;
      } else {
        mega_ms = 0;
        if (place == SwitchPlace::kOther || armed_ms != 0) counted = false;
        armed_ms = 0;
      }
    }
    CHECK(bench.starts > 0);
  }
}
