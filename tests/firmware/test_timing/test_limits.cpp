// The same classes at the very edge of each of their times.
#include "check.h"
#include "core/byte_budget.h"
#include "core/every.h"
#include "core/health.h"
#include "core/ident_trigger.h"
#include "core/storm_guard.h"

namespace {

using Source = core::IdentTrigger::Source;

constexpr uint32_t kStartUs = 0xFFFFFFFFU - 9000U;  // the clock wraps on the way
constexpr uint32_t kStepUs = 15625;                 // a 64th of a second

// Half of the packet period as measured so far: a bad packet is due that much before its time.
uint32_t half_period_us(const core::IdentTrigger& trigger, uint32_t last_us) {
  uint32_t least_us = 0;
  uint32_t most_us = trigger.period_us();
  while (least_us < most_us) {
    const uint32_t middle_us = (least_us + most_us) / 2;
    core::IdentTrigger copy = trigger;
    if (copy.bad_packet(last_us + middle_us)) {
      most_us = middle_us;
    } else {
      least_us = middle_us + 1;
    }
  }
  return trigger.period_us() - least_us;
}

// One whose last trigger was a packet at kStartUs, number 2, served at once.
core::IdentTrigger led(uint16_t rate_hz = 100) {
  core::IdentTrigger trigger;
  trigger.start(rate_hz, kStartUs - 20000);
  trigger.imu_packet(2, kStartUs, false);
  CHECK(trigger.poll(kStartUs + 1100, true) == Source::kImu);
  return trigger;
}

// One whose timer was started at kStartUs and no packet is heard.
core::IdentTrigger timed(uint16_t rate_hz = 100) {
  core::IdentTrigger trigger;
  trigger.start(rate_hz, kStartUs);
  return trigger;
}

// When the timer is due next, looked at with as many copies.
uint32_t next_timer_us(const core::IdentTrigger& trigger, uint32_t from_us) {
  for (uint32_t t_us = from_us; t_us - from_us < 40000U; ++t_us) {
    core::IdentTrigger copy = trigger;
    if (copy.poll(t_us, true) == Source::kTimer) {
      return t_us;
    }
  }
  return from_us - 1;  // never
}

}  // namespace

TEST_CASE("the mask is that of the nearest number of packets a period") {
  const struct {
    uint16_t rate_hz;
    uint8_t mask;
  } cases[] = {{200, 0},
               {134, 0},
               {133, 1},
               {100, 1},
               {58, 1},
               {57, 3},
               {50, 3},
               {27, 3},
               {26, 7},
               {25, 7},
               {10, 7}};
  for (const auto& one : cases) {
    core::IdentTrigger trigger;
    trigger.start(one.rate_hz, 0);
    CHECK_EQ(trigger.mask(), one.mask);
    CHECK_EQ(trigger.period_us(), 1000000U / one.rate_hz);
  }
}

TEST_CASE("the packet period moves by an eighth, between neighbours of 1 to 30 ms") {
  const struct {
    uint32_t since_us;
    uint8_t by;
    uint16_t period_us;
  } cases[] = {{999, 1, 5000},
               {1000, 1, 4500},
               {5000, 1, 5000},
               {5016, 1, 5002},
               {10000, 1, 5625},
               {30000, 1, 8125},
               {30001, 1, 5000},
               {10000, 2, 5000},
               {10000, 0, 5000},
               {10000, 255, 5000}};
  for (const auto& one : cases) {
    core::IdentTrigger trigger;
    trigger.start(50, kStartUs - 9000);
    trigger.imu_packet(255, kStartUs, true);
    CHECK_EQ(half_period_us(trigger, kStartUs), 2500U);
    trigger.imu_packet(static_cast<uint8_t>(255 + one.by), kStartUs + one.since_us, true);
    CHECK_EQ(half_period_us(trigger, kStartUs + one.since_us), one.period_us / 2U);
  }
}

TEST_CASE("the mask is measured anew at every eighth number") {
  core::IdentTrigger trigger;
  trigger.start(100, 0);
  uint32_t t_us = 0;
  for (uint8_t seq = 1; seq < 64; ++seq) {
    t_us += 10000;
    trigger.imu_packet(seq, t_us, true);
    // 6666 us and more are no half of 10 ms any more.
    if (seq < 8) {
      CHECK_EQ(trigger.mask(), 1);
    }
    if (seq >= 16) {
      CHECK_EQ(trigger.mask(), 0);
    }
  }
}

TEST_CASE("a packet in phase is a frame at once, late behind 2.1 ms, left out behind a period") {
  for (uint32_t after_us = 2099; after_us <= 2102; ++after_us) {
    core::IdentTrigger trigger = led();
    trigger.imu_packet(4, kStartUs + 10000, false);
    CHECK(trigger.poll(kStartUs + 10000 + after_us, true) == Source::kImu);
    CHECK_EQ(trigger.late(), after_us > 2100 ? 1 : 0);
    CHECK_EQ(trigger.overruns(), 0);
  }
  core::IdentTrigger trigger = led();
  trigger.imu_packet(4, kStartUs + 10000, false);
  for (uint32_t after_us = 1000; after_us < 10000; after_us += 500) {
    CHECK(trigger.poll(kStartUs + 10000 + after_us, false) == Source::kNone);
  }
  core::IdentTrigger last = trigger;
  CHECK(last.poll(kStartUs + 10000 + 9999, true) == Source::kImu);
  CHECK_EQ(last.overruns(), 0);
  core::IdentTrigger waiting = trigger;
  CHECK(waiting.poll(kStartUs + 10000 + 9999, false) == Source::kNone);
  CHECK_EQ(waiting.overruns(), 0);
  CHECK(trigger.poll(kStartUs + 10000 + 10000, false) == Source::kNone);
  CHECK_EQ(trigger.overruns(), 1);
  CHECK_EQ(trigger.late(), 0);
  // It has set the phase all the same, and is not asked for again.
  CHECK_EQ(next_timer_us(trigger, kStartUs + 20001), kStartUs + 10000 + 15000);
}

TEST_CASE("a packet out of phase or too soon behind the last is no frame") {
  core::IdentTrigger odd = led();
  odd.imu_packet(5, kStartUs + 10000, false);
  CHECK(odd.poll(kStartUs + 11100, true) == Source::kNone);
  CHECK_EQ(next_timer_us(odd, kStartUs + 11200), kStartUs + 15000);
  for (uint32_t since_us = 7498; since_us <= 7501; ++since_us) {
    core::IdentTrigger trigger = led();
    trigger.imu_packet(6, kStartUs + since_us, false);
    CHECK_EQ(trigger.poll(kStartUs + since_us + 1100, true) == Source::kImu, since_us >= 7500);
  }
  // Behind the timer the first in phase leads again, however soon.
  core::IdentTrigger trigger = led();
  CHECK(trigger.poll(kStartUs + 15000, true) == Source::kTimer);
  trigger.imu_packet(6, kStartUs + 15100, false);
  CHECK(trigger.poll(kStartUs + 16200, true) == Source::kImu);
}

TEST_CASE("the timer: a period from the start and from itself, one and a half behind a packet") {
  core::IdentTrigger trigger = timed();
  CHECK_EQ(next_timer_us(trigger, kStartUs - 100), kStartUs + 10000);
  CHECK(trigger.poll(kStartUs + 10000, true) == Source::kTimer);
  CHECK_EQ(next_timer_us(trigger, kStartUs + 10001), kStartUs + 20000);
  CHECK_EQ(next_timer_us(led(), kStartUs + 1200), kStartUs + 15000);
  core::IdentTrigger bad = led();
  CHECK(!bad.bad_packet(kStartUs + 7499));
  CHECK(bad.bad_packet(kStartUs + 7500));
  CHECK_EQ(next_timer_us(bad, kStartUs + 7600), kStartUs + 22500);
  // A packet that is still on its way when the loop looks has its start in the future.
  core::IdentTrigger ahead = led();
  ahead.imu_packet(4, kStartUs + 10000, true);
  CHECK(ahead.poll(kStartUs + 9000, true) == Source::kNone);
}

TEST_CASE(
    "the timer: seen late it keeps its phase, by half a millisecond more where it just missed") {
  const struct {
    uint32_t behind_us;
    uint32_t next_us;
  } cases[] = {{0, 20000},
               {849, 20000},
               {850, 20500},
               {999, 20500},
               {1000, 20000},
               {9999, 20000},
               {10000, 30000},
               {10001, 30001}};
  for (const auto& one : cases) {
    core::IdentTrigger trigger = timed();
    CHECK(trigger.poll(kStartUs + 10000 + one.behind_us, true) == Source::kTimer);
    CHECK_EQ(trigger.late(), one.behind_us > 1000 ? 1 : 0);
    CHECK_EQ(next_timer_us(trigger, kStartUs + 10001 + one.behind_us), kStartUs + one.next_us);
  }
}

TEST_CASE("the timer waits for what is not ready for a period, then leaves the frame out") {
  core::IdentTrigger trigger = timed();
  CHECK(trigger.poll(kStartUs + 10000, false) == Source::kNone);
  CHECK(trigger.poll(kStartUs + 19999, false) == Source::kNone);
  CHECK_EQ(trigger.overruns(), 0);
  core::IdentTrigger ready = trigger;
  CHECK(ready.poll(kStartUs + 19999, true) == Source::kTimer);
  CHECK_EQ(ready.overruns(), 0);
  CHECK(trigger.poll(kStartUs + 20000, false) == Source::kNone);
  CHECK_EQ(trigger.overruns(), 1);
  CHECK_EQ(trigger.late(), 0);
  CHECK_EQ(next_timer_us(trigger, kStartUs + 20001), kStartUs + 30000);
}

TEST_CASE("a start forgets the packet that waited and who led") {
  core::IdentTrigger trigger = led();
  trigger.imu_packet(4, kStartUs + 10000, false);
  trigger.start(100, kStartUs + 11000);
  CHECK(trigger.poll(kStartUs + 11100, true) == Source::kNone);
  CHECK_EQ(next_timer_us(trigger, kStartUs + 11200), kStartUs + 21000);
}

TEST_CASE("counts of late frames and of those left out stay at their last number") {
  core::IdentTrigger late = timed(200);
  core::IdentTrigger left_out = timed(200);
  uint32_t t_us = kStartUs;
  for (uint32_t i = 0; i < 65537; ++i) {
    t_us += 6001;
    late.poll(t_us, true);
    t_us += 5000;
    left_out.poll(t_us, false);
    if (i == 2) {
      CHECK_EQ(late.late(), 3);
      CHECK_EQ(left_out.overruns(), 3);
    }
  }
  CHECK_EQ(late.late(), 0xFFFF);
  CHECK_EQ(left_out.overruns(), 0xFFFF);
}

TEST_CASE("the radio's budget grows by a 64th of a second, to half a second, to the byte") {
  core::ByteBudget budget;
  budget.start(kStartUs, 640);
  CHECK(!budget.take(1, kStartUs + 15624));
  CHECK(!budget.take(11, kStartUs + 15625));
  CHECK(budget.take(10, kStartUs + 15625));
  CHECK(!budget.take(1, kStartUs + 31249));
  CHECK(budget.take(4, kStartUs + 31250));
  CHECK(budget.take(6, kStartUs + 31250));
  CHECK(!budget.take(1, kStartUs + 31250));
  CHECK(budget.take(0, kStartUs + 31250));
  // 31 steps, then 32 and a part: the part is kept.
  budget.start(kStartUs, 640);
  CHECK(!budget.take(311, kStartUs + 31 * kStepUs));
  CHECK(budget.take(310, kStartUs + 31 * kStepUs));
  budget.start(kStartUs, 640);
  CHECK(budget.take(320, kStartUs + 32 * kStepUs + 15624));
  CHECK(budget.take(10, kStartUs + 33 * kStepUs));
  // 33 steps are half a second, and time begins anew there.
  budget.start(kStartUs, 640);
  CHECK(!budget.take(321, kStartUs + 33 * kStepUs + 5));
  CHECK(budget.take(320, kStartUs + 33 * kStepUs + 5));
  CHECK(!budget.take(1, kStartUs + 34 * kStepUs + 4));
  CHECK(budget.take(10, kStartUs + 34 * kStepUs + 5));
  budget.start(kStartUs, 640);
  CHECK(budget.take(320, kStartUs + 33 * kStepUs));
  CHECK(!budget.take(1, kStartUs + 33 * kStepUs));
  CHECK(!budget.take(1, kStartUs + 34 * kStepUs - 1));
  CHECK(budget.take(10, kStartUs + 34 * kStepUs));
  // A start has nothing saved.
  budget.start(kStartUs, 640);
  CHECK(!budget.take(320, kStartUs + 20 * kStepUs));
  budget.start(kStartUs + 20 * kStepUs, 6400);
  CHECK(!budget.take(1, kStartUs + 20 * kStepUs));
  CHECK(budget.take(100, kStartUs + 21 * kStepUs));
  // What is saved and what comes are at most half a second together.
  budget.start(kStartUs, 640);
  for (uint8_t step = 1; step <= 40; ++step) {
    CHECK(budget.take(0, kStartUs + step * kStepUs));
  }
  CHECK(!budget.take(321, kStartUs + 40 * kStepUs));
  CHECK(budget.take(320, kStartUs + 40 * kStepUs));
}

TEST_CASE("a slow task is due at its time, not before, and left out when a whole period late") {
  core::Every task;
  task.start(kStartUs);
  CHECK(!task.due(kStartUs - 1, 100));
  CHECK(task.due(kStartUs, 100));
  CHECK(task.due(kStartUs + 199, 100));  // 99 late: its phase stays
  CHECK(task.due(kStartUs + 200, 100));
  CHECK(task.due(kStartUs + 400, 100));  // 100 late: begun anew
  CHECK(!task.due(kStartUs + 499, 100));
  CHECK(task.due(kStartUs + 500, 100));
  CHECK(task.due(kStartUs + 755, 100));  // 155 late
  CHECK(!task.due(kStartUs + 854, 100));
  CHECK(task.due(kStartUs + 855, 100));
}

TEST_CASE("each of up to eight tasks holds the heartbeat back, others do not") {
  for (uint8_t tasks = 1; tasks <= 8; ++tasks) {
    for (uint8_t missing = 0; missing < 8; ++missing) {
      core::HealthGate gate(tasks);
      for (uint8_t task = 0; task < 8; ++task) {
        if (task != missing) {
          gate.ran(task);
        }
      }
      CHECK_EQ(gate.beat(600), missing >= tasks);
      gate.ran(missing);
      CHECK_EQ(gate.beat(1099), missing < tasks);
      CHECK(!gate.beat(9000));  // all are asked again
    }
  }
  core::HealthGate first(1);
  first.ran(0);
  CHECK(!first.beat(499));
  CHECK(first.beat(500));
  core::HealthGate gate(1);
  gate.ran(0);
  CHECK(gate.beat(0xFFFFFF00U));
  gate.ran(0);
  CHECK(!gate.beat(0xFFFFFF00U + 499));
  CHECK(gate.beat(0xFFFFFF00U + 500));
}

TEST_CASE("24 edges in a millisecond are none too many, 25 mask the bank for 20 ms") {
  core::StormGuard guard;
  for (uint8_t ms = 0; ms < 30; ++ms) {
    for (uint8_t edge = 0; edge < 24; ++edge) {
      CHECK(guard.edge());
    }
    CHECK(!guard.masked());
    CHECK(!guard.tick());
  }
  for (uint8_t again = 0; again < 2; ++again) {
    for (uint8_t edge = 0; edge < 24; ++edge) {
      CHECK(guard.edge());
    }
    CHECK(!guard.edge());
    CHECK(guard.masked());
    for (uint8_t ms = 1; ms < 20; ++ms) {
      CHECK(!guard.tick());
      CHECK(guard.masked());
    }
    CHECK(guard.tick());
    CHECK(!guard.masked());
  }
}
