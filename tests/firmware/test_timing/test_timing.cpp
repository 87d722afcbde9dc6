// Triggers, slow tasks, proof of life and byte budget on a clock of the test's own.
#include "check.h"
#include "core/byte_budget.h"
#include "core/every.h"
#include "core/health.h"
#include "core/ident_trigger.h"
#include "core/storm_guard.h"

namespace {

using Source = core::IdentTrigger::Source;

constexpr uint32_t kTransferUs = 1000;  // START to STOP

// An IMU whose packets end every `packet_us`, a loop that turns every `turn_us`, a frame that takes
// 4.6 ms; packets from `silent_from` to `silent_to` are lost. No packet starts a scan by itself.
struct Run {
  uint32_t packet_us = 5000;
  uint32_t turn_us = 100;
  uint32_t silent_from = 0xFFFFFFFFU;
  uint32_t silent_to = 0xFFFFFFFFU;
  uint32_t start_us = 0xFFFFFFFFU - 200000U;  // the clock wraps on the way

  uint16_t imu = 0;
  uint16_t timer = 0;
  uint32_t least_us = 0xFFFFFFFFU;
  uint32_t most_us = 0;

  void fly(core::IdentTrigger& trigger, uint16_t rate_hz, uint32_t length_us) {
    trigger.start(rate_hz, start_us);
    uint8_t seq = 250;
    uint32_t next_packet_us = 1234;
    uint32_t last_us = 0;
    for (uint32_t t_us = 0; t_us < length_us; t_us += turn_us) {
      while (next_packet_us <= t_us) {
        if (next_packet_us < silent_from || next_packet_us >= silent_to) {
          trigger.imu_packet(seq, start_us + next_packet_us - kTransferUs, false);
        }
        ++seq;
        next_packet_us += packet_us;
      }
      const bool ready = last_us == 0 || t_us - last_us >= 4600;
      const Source source = trigger.poll(start_us + t_us, ready);
      if (source == Source::kNone) {
        continue;
      }
      imu = static_cast<uint16_t>(imu + (source == Source::kImu));
      timer = static_cast<uint16_t>(timer + (source == Source::kTimer));
      if (last_us != 0) {
        const uint32_t since_us = t_us - last_us;
        least_us = since_us < least_us ? since_us : least_us;
        most_us = since_us > most_us ? since_us : most_us;
      }
      last_us = t_us;
    }
  }
};

}  // namespace

TEST_CASE("every second packet at 100 Hz, each packet at 200 Hz, every fourth at 50 Hz") {
  const uint16_t rates[] = {100, 200, 50};
  for (const uint16_t rate_hz : rates) {
    core::IdentTrigger trigger;
    Run run;
    run.fly(trigger, rate_hz, 1000000);
    CHECK(run.imu >= rate_hz - 1);
    CHECK(run.imu <= rate_hz + 1);
    CHECK_EQ(run.timer, 0);
    CHECK(run.most_us <= trigger.period_us() + 100);
    CHECK(run.least_us >= trigger.period_us() - 100);
    CHECK_EQ(trigger.overruns(), 0);
    CHECK_EQ(trigger.late(), 0);
  }
}

TEST_CASE("at a lower rate the sample's number says which are kept, whatever came first") {
  for (uint8_t first = 0; first < 8; ++first) {
    core::IdentTrigger trigger;
    trigger.start(50, 0);  // every fourth of 200 Hz
    uint8_t kept = 0;
    for (uint8_t i = 0; i < 40; ++i) {
      const uint8_t seq = static_cast<uint8_t>(first + i);
      const uint32_t t_us = 1000U + 5000U * i;
      trigger.imu_packet(seq, t_us, false);
      if (trigger.poll(t_us, true) == Source::kImu) {
        CHECK_EQ(seq & 3, 0);
        ++kept;
      }
    }
    CHECK(kept >= 9);
  }
}

TEST_CASE("a packet that has started its scan is not asked for again, and the timer follows it") {
  core::IdentTrigger trigger;
  const uint32_t start_us = 0xFFFFFFFFU - 20000U;
  trigger.start(100, start_us);
  for (uint32_t at_us = 2000; at_us < 60000; at_us += 10000) {
    trigger.imu_packet(static_cast<uint8_t>(at_us / 10000), start_us + at_us, true);
    for (uint32_t t_us = 1000; t_us < 10000; t_us += 1000) {
      CHECK(trigger.poll(start_us + at_us + t_us, t_us > 5000) == Source::kNone);
    }
  }
  // Silent from here on: a period and a half behind the last packet.
  CHECK(trigger.poll(start_us + 52000 + 14999, true) == Source::kNone);
  CHECK(trigger.poll(start_us + 52000 + 15000, true) == Source::kTimer);
  CHECK_EQ(trigger.late(), 0);
  CHECK_EQ(trigger.overruns(), 0);
}

TEST_CASE("the scan of a bad packet makes a frame when one is due, and only then") {
  core::IdentTrigger trigger;
  trigger.start(100, 0);
  trigger.imu_packet(2, 10000, true);
  CHECK(!trigger.bad_packet(15000));
  CHECK(trigger.poll(16000, true) == Source::kNone);
  CHECK(trigger.bad_packet(20000));
  CHECK(trigger.poll(34999, true) == Source::kNone);
  CHECK(trigger.poll(35000, true) == Source::kTimer);
}

TEST_CASE("the mask follows the measured packet period") {
  core::IdentTrigger trigger;
  trigger.start(100, 0);
  CHECK_EQ(trigger.mask(), 1);  // 200 Hz until measured
  uint32_t t_us = 0;
  for (uint8_t seq = 0; seq < 100; ++seq) {
    t_us += 10000;
    trigger.imu_packet(seq, t_us, false);
  }
  CHECK_EQ(trigger.mask(), 0);
  trigger.start(25, t_us);
  CHECK_EQ(trigger.mask(), 3);
}

TEST_CASE("only a packet of the new kind, whole and in phase, starts a scan") {
  uint8_t bytes[frames::kImuPacketSize] = {frames::kImuPacketKind, 6};
  const uint8_t address = frames::kImuPacketAddress;
  const uint8_t size = frames::kImuPacketSize;
  CHECK(core::starts_scan(address, size, bytes, 0));
  CHECK(core::starts_scan(address, size, bytes, 1));
  CHECK(!core::starts_scan(address, size, bytes, 3));
  CHECK(!core::starts_scan(frames::kOriginalImu1PacketAddress, size, bytes, 0));
  CHECK(!core::starts_scan(address, static_cast<uint8_t>(size - 1), bytes, 0));
  bytes[0] ^= 1;
  CHECK(!core::starts_scan(address, size, bytes, 0));
}

TEST_CASE("an IMU clock half a percent off does not slip a packet") {
  const uint16_t packets_us[] = {4975, 5025};
  for (const uint16_t packet_us : packets_us) {
    core::IdentTrigger trigger;
    Run run;
    run.packet_us = packet_us;
    run.fly(trigger, 100, 1000000);
    CHECK_EQ(run.timer, 0);
    CHECK(run.most_us <= 2U * packet_us + 100);
    CHECK(run.least_us >= 2U * packet_us - 100);
  }
}

TEST_CASE("no packet at all: the timer keeps the rate from the start") {
  core::IdentTrigger trigger;
  Run run;
  run.silent_from = 0;
  run.fly(trigger, 100, 1000000);
  CHECK_EQ(run.imu, 0);
  CHECK(run.timer >= 98);
  CHECK(run.timer <= 100);
  CHECK(run.most_us <= 10100);
}

TEST_CASE("silence: the timer steps in after 1.5 periods, packets take over again") {
  const uint16_t rates[] = {100, 200};
  for (const uint16_t rate_hz : rates) {
    core::IdentTrigger trigger;
    Run run;
    run.silent_from = 300000;
    run.silent_to = 600000;
    run.fly(trigger, rate_hz, 1000000);
    CHECK(run.timer >= rate_hz * 3 / 10 - 3);
    CHECK(run.timer <= rate_hz * 3 / 10 + 2);
    CHECK(run.imu >= rate_hz * 7 / 10 - 3);
    CHECK(run.most_us <= trigger.period_us() * 3 / 2 + 200);
    CHECK(trigger.overruns() <= 2);
  }
}

TEST_CASE("one lost packet at 200 Hz: the two clocks do not go on meeting each other") {
  core::IdentTrigger trigger;
  Run run;
  run.silent_from = 500000;
  run.silent_to = 504000;
  run.fly(trigger, 200, 1000000);
  CHECK(run.timer <= 1);
  CHECK(run.imu >= 196);
  CHECK(run.most_us <= 10000);
}

TEST_CASE("a loop that turns late is counted") {
  core::IdentTrigger trigger;
  Run run;
  run.turn_us = 2300;
  run.fly(trigger, 100, 1000000);
  CHECK(trigger.late() > 20);
}

TEST_CASE("a slow task keeps its phase and leaves late turns out") {
  core::Every task;
  const uint32_t start_us = 0xFFFFFF00U;
  task.start(start_us);
  CHECK(task.due(start_us, 40000));
  CHECK(!task.due(start_us + 39999, 40000));
  CHECK(task.due(start_us + 41000, 40000));
  CHECK(task.due(start_us + 80000, 40000));
  CHECK(task.due(start_us + 200000, 40000));
  CHECK(!task.due(start_us + 200001, 40000));
  CHECK(task.due(start_us + 240000, 40000));
}

TEST_CASE("no heartbeat until every task has run, and none sooner than half a millisecond") {
  core::HealthGate gate(3);
  CHECK(!gate.beat(5000));
  gate.ran(0);
  gate.ran(2);
  CHECK(!gate.beat(6000));
  gate.ran(1);
  CHECK(gate.beat(7000));
  CHECK(!gate.beat(7400));
  gate.ran(0);
  gate.ran(1);
  gate.ran(2);
  CHECK(!gate.beat(7499));
  CHECK(gate.beat(7500));
}

TEST_CASE("a stuck task stops the heartbeat for good") {
  core::HealthGate gate(2);
  uint16_t beats = 0;
  for (uint32_t t_us = 0; t_us < 100000; t_us += 250) {
    gate.ran(0);
    if (t_us < 50000) {
      gate.ran(1);
    }
    beats = static_cast<uint16_t>(beats + gate.beat(t_us));
  }
  CHECK(beats >= 98);
  CHECK(beats <= 100);
}

TEST_CASE("an edge storm masks the bank and costs 25 edges in 20 ms") {
  core::StormGuard guard;
  uint16_t served = 0;
  bool masked = false;
  uint8_t unmasked = 0;
  for (uint16_t ms = 0; ms < 200; ++ms) {
    for (uint8_t edge = 0; edge < 100 && !masked; ++edge) {
      ++served;
      masked = !guard.edge();
    }
    if (guard.tick()) {
      masked = false;
      ++unmasked;
    }
  }
  CHECK_EQ(unmasked, 10);
  CHECK_EQ(served, 250);
}

TEST_CASE("a receiver that sends all channels at once is no storm") {
  core::StormGuard guard;
  uint16_t refused = 0;
  for (uint16_t ms = 0; ms < 100; ++ms) {
    for (uint8_t edge = 0; edge < 10; ++edge) {
      refused = static_cast<uint16_t>(refused + !guard.edge());
    }
    refused = static_cast<uint16_t>(refused + guard.tick());
  }
  CHECK_EQ(refused, 0);
}

TEST_CASE("the radio is never given more than its budget") {
  core::ByteBudget budget;
  const uint32_t start_us = 0xFFFF0000U;
  budget.start(start_us, 2600);
  CHECK(!budget.take(73, start_us));
  uint32_t given = 0;
  for (uint32_t t_us = 0; t_us < 10000000U; t_us += 700) {
    given += budget.take(73, start_us + t_us) ? 73U : 0U;
  }
  CHECK(given <= 26000U);
  CHECK(given >= 25000U);
  // A long silence saves half a second, no more.
  uint32_t burst = 0;
  while (budget.take(10, start_us + 100000000U)) {
    burst += 10;
  }
  CHECK(burst <= 1300U);
  CHECK(burst >= 1200U);
}
