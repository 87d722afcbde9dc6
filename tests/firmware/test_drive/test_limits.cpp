// Who drives, at the very limits: widths to the tick, times to the microsecond, channels one by
// one.
#include "check.h"
#include "core/drive.h"
#include "core/settings.h"

namespace {

using frames::Drive;

constexpr uint8_t kAll = 0b1'1111;
constexpr uint16_t kDirectTicks = 2200;
constexpr uint16_t kMegaTicks = 3800;

struct Turns {
  core::DriveControl drive;
  frames::ConfigFrame config;
  core::RcChannels rc = {{3000, 2900, 3100, 2000, kDirectTicks}, kAll, kAll};
  bool self_test = true;
  uint32_t now_us = 0xFFFFFFFFU - 120000U;

  Turns() { core::default_settings(config); }

  Drive turn(uint32_t later_us) {
    now_us += later_us;
    drive.update(rc, config, self_test, now_us);
    return drive.drive();
  }
  Drive at(uint16_t switch_ticks, uint32_t later_us) {
    rc.width_ticks[core::kSwitch] = switch_ticks;
    return turn(later_us);
  }
  // The switch comes there and stays for just the time that counts.
  Drive settle(uint16_t switch_ticks) {
    at(switch_ticks, 5000);
    return turn(core::DriveControl::kSwitchSettleUs);
  }
  Drive engage() {
    settle(kDirectTicks);
    return settle(kMegaTicks);
  }
  void hear(uint8_t channels) {
    for (uint8_t i = 0; i < core::kChannels; ++i) {
      if ((channels >> i & 1) == 0) {
        rc.width_ticks[i] = 0;
      }
    }
    rc.steady = channels;
    rc.fresh = channels;
  }
};

}  // namespace

TEST_CASE("direct and Mega count at 100 ms, not a microsecond before") {
  Turns turns;
  turns.at(kDirectTicks, 0);
  turns.turn(core::DriveControl::kSwitchSettleUs - 1);
  CHECK(turns.settle(kMegaTicks) == Drive::kDirectSwitch);
  turns.at(kDirectTicks, 0);
  turns.turn(core::DriveControl::kSwitchSettleUs);
  turns.at(kMegaTicks, 0);
  CHECK(turns.turn(core::DriveControl::kSwitchSettleUs - 1) == Drive::kDirectSwitch);
  CHECK(turns.turn(1) == Drive::kMega);
}

TEST_CASE("the width that the settings call direct arms, a tick more does not") {
  Turns turns;
  const uint16_t most_ticks = static_cast<uint16_t>(2 * turns.config.switch_direct_max_us);
  CHECK(turns.settle(static_cast<uint16_t>(most_ticks + 1)) == Drive::kDirectSwitch);
  CHECK(turns.settle(kMegaTicks) == Drive::kDirectSwitch);
  turns.settle(most_ticks);
  CHECK(turns.settle(kMegaTicks) == Drive::kMega);
}

TEST_CASE("the width that the settings call Mega engages, a tick less releases") {
  Turns turns;
  const uint16_t least_ticks = static_cast<uint16_t>(2 * turns.config.switch_mega_min_us);
  turns.settle(kDirectTicks);
  CHECK(turns.settle(static_cast<uint16_t>(least_ticks - 1)) == Drive::kDirectSwitch);
  CHECK(turns.settle(least_ticks) == Drive::kMega);
  CHECK(turns.at(static_cast<uint16_t>(least_ticks - 1), 5000) == Drive::kDirectSwitch);
}

TEST_CASE("950 us of the switch is direct, half a microsecond less a lost receiver that disarms") {
  Turns turns;
  CHECK(turns.settle(1900) == Drive::kDirectSwitch);
  CHECK(turns.settle(kMegaTicks) == Drive::kMega);
  CHECK(turns.at(1899, 5000) == Drive::kDirectReceiverLost);
  turns.settle(1900);
  CHECK(turns.at(1899, 5000) == Drive::kDirectReceiverLost);
  CHECK(turns.settle(kMegaTicks) == Drive::kDirectSwitch);
}

TEST_CASE(
    "a hold ends when its time is full, not a microsecond before, and begins anew each time") {
  Turns turns;
  turns.config.hold_ms = 60000;  // beyond what 16 bits hold in microseconds
  CHECK(turns.engage() == Drive::kMega);
  const core::RcChannels good = turns.rc;
  turns.hear(0);
  CHECK(turns.turn(5000) == Drive::kMegaHolding);
  CHECK(turns.turn(59999999) == Drive::kMegaHolding);
  turns.rc = good;
  CHECK(turns.turn(0) == Drive::kMega);
  turns.hear(0);
  CHECK(turns.turn(1) == Drive::kMegaHolding);
  CHECK(turns.turn(59999999) == Drive::kMegaHolding);
  CHECK(turns.turn(1) == Drive::kDirectReceiverLost);
  turns.rc = good;
  CHECK(turns.settle(kMegaTicks) == Drive::kDirectSwitch);
}

TEST_CASE("a hold that is overdue ends too: the turn that would have ended it came late") {
  Turns turns;
  turns.config.hold_ms = 400;
  turns.engage();
  turns.hear(0);
  turns.turn(5000);
  CHECK(turns.turn(400003) == Drive::kDirectReceiverLost);
}

TEST_CASE("a hold of a millisecond is one, of none is none") {
  for (uint16_t hold_ms = 0; hold_ms < 2; ++hold_ms) {
    Turns turns;
    turns.config.hold_ms = hold_ms;
    turns.engage();
    turns.hear(0);
    CHECK(turns.turn(5000) == (hold_ms == 0 ? Drive::kDirectReceiverLost : Drive::kMegaHolding));
    turns.turn(1000);
    CHECK(turns.drive.drive() == Drive::kDirectReceiverLost);
  }
}

TEST_CASE("the switch anywhere but at Mega, or a failed self-test, is never held") {
  const uint16_t places_ticks[] = {1899, kDirectTicks, 3000};
  const Drive why[] = {Drive::kDirectReceiverLost, Drive::kDirectSwitch, Drive::kDirectSwitch};
  for (uint8_t i = 0; i < 3; ++i) {
    Turns turns;
    turns.config.hold_ms = 400;
    turns.engage();
    CHECK(turns.at(places_ticks[i], 5000) == why[i]);
  }
  Turns turns;
  turns.config.hold_ms = 400;
  turns.engage();
  turns.self_test = false;
  CHECK(turns.turn(5000) == Drive::kDirectSelfTest);
}

TEST_CASE("without the switch, any servo channel still fresh makes it a lost switch") {
  for (uint8_t channel = 0; channel < core::kChannels; ++channel) {
    Turns turns;
    turns.config.hold_ms = 400;
    turns.engage();
    turns.hear(0);
    turns.rc.fresh = static_cast<uint8_t>(1U << channel);
    CHECK(turns.turn(5000) ==
          (channel == core::kSwitch ? Drive::kMegaHolding : Drive::kDirectSwitchInvalid));
  }
}

TEST_CASE("each channel that is missing is named, and only it") {
  for (uint8_t channel = 0; channel < core::kChannels; ++channel) {
    Turns turns;
    CHECK_EQ(turns.drive.missing(), kAll);
    turns.hear(static_cast<uint8_t>(kAll & ~(1U << channel)));
    turns.turn(5000);
    CHECK_EQ(turns.drive.missing(), 1U << channel);
    for (uint8_t servo = 0; servo < core::kServos; ++servo) {
      CHECK((turns.drive.servo_ticks(servo) == 0) == (servo == channel));
    }
  }
}

TEST_CASE("all that are missing at once are named") {
  Turns turns;
  turns.hear(0b0'1001);
  turns.turn(5000);
  CHECK_EQ(turns.drive.missing(), 0b1'0110);
}

TEST_CASE("before all channels were heard it says boot; then what is gone, and self-test first") {
  Turns turns;
  turns.hear(0b0'1111);
  CHECK(turns.turn(5000) == Drive::kDirectBoot);
  turns.self_test = false;
  CHECK(turns.turn(5000) == Drive::kDirectSelfTest);
  turns.self_test = true;
  CHECK(turns.turn(5000) == Drive::kDirectBoot);
  turns = Turns();
  turns.turn(5000);
  turns.hear(0b0'1111);
  CHECK(turns.turn(5000) == Drive::kDirectSwitchInvalid);
  for (uint8_t servo = 0; servo < core::kServos; ++servo) {
    turns.rc.steady = static_cast<uint8_t>(0b0'1111 & ~(1U << servo));
    CHECK(turns.turn(5000) == Drive::kDirectReceiverLost);
    turns.rc.steady = static_cast<uint8_t>(kAll & ~(1U << servo));
    CHECK(turns.turn(5000) == Drive::kDirectReceiverLost);
  }
}

TEST_CASE("any channel unsteady for one turn disarms, a self-test that fails too") {
  for (uint8_t channel = 0; channel <= core::kChannels; ++channel) {
    Turns turns;
    turns.settle(kDirectTicks);
    turns.self_test = channel != core::kChannels;
    turns.rc.steady = static_cast<uint8_t>(kAll & ~(1U << channel));
    turns.turn(5000);
    turns.self_test = true;
    turns.rc.steady = kAll;
    turns.at(kMegaTicks, 5000);
    CHECK(turns.turn(200000) == Drive::kDirectSwitch);
  }
}

TEST_CASE("released by the switch it holds nothing back: arming is the same sequence again") {
  Turns turns;
  CHECK(turns.engage() == Drive::kMega);
  CHECK(turns.at(3000, 5000) == Drive::kDirectSwitch);
  CHECK(turns.settle(kMegaTicks) == Drive::kDirectSwitch);
  CHECK(turns.engage() == Drive::kMega);
}

TEST_CASE("a lost relay stays said with the switch between, until direct") {
  Turns turns;
  turns.engage();
  turns.drive.relay_lost();
  CHECK(turns.settle(3000) == Drive::kDirectRelay);
  CHECK(turns.at(kDirectTicks, 5000) == Drive::kDirectSwitch);
  turns.turn(200000);
  CHECK(turns.settle(kMegaTicks) == Drive::kMega);
}

TEST_CASE("a hold keeps what came last: a live channel stays live, throttle is never held") {
  Turns turns;
  turns.config.hold_ms = 400;
  turns.engage();
  turns.rc.steady = 0b1'1100;
  turns.rc.width_ticks[core::kRudder] = 3111;
  CHECK(turns.turn(5000) == Drive::kMegaHolding);
  CHECK_EQ(turns.drive.servo_ticks(core::kAileron), 3000);
  CHECK_EQ(turns.drive.servo_ticks(core::kElevator), 2900);
  CHECK_EQ(turns.drive.servo_ticks(core::kRudder), 3111);
  CHECK_EQ(turns.drive.servo_ticks(core::kThrottle), 2000);
  turns.rc.steady = 0b1'0000;
  turns.turn(5000);
  CHECK_EQ(turns.drive.servo_ticks(core::kRudder), 3111);
  CHECK_EQ(turns.drive.servo_ticks(core::kThrottle), 0);
}

namespace {

// All inputs rise together; input i is high for 1000 us and 200 us more each.
void send_frame(core::RcDecoder& decoder, uint32_t now_ticks) {
  decoder.edge(now_ticks, kAll, false);
  for (uint8_t i = 0; i < core::kRcInputs; ++i) {
    decoder.edge(
        now_ticks + 2000 + uint32_t{400} * i, static_cast<uint8_t>(kAll << (i + 1) & kAll), false);
  }
  decoder.poll(now_ticks + 8000);
}

}  // namespace

TEST_CASE("every input can be every channel, with its width and both its bits") {
  for (uint8_t shift = 0; shift < core::kRcInputs; ++shift) {
    core::RcDecoder decoder;
    decoder.edge(0, 0, false);
    send_frame(decoder, 40000);
    uint8_t input[core::kChannels];
    for (uint8_t i = 0; i < core::kChannels; ++i) {
      input[i] = static_cast<uint8_t>((i + shift) % core::kRcInputs);
    }
    input[core::kRudder] = core::kRcInputs;  // the first that is none
    frames::ConfigFrame config;
    core::default_settings(config);
    config.input_aileron = input[0];
    config.input_elevator = input[1];
    config.input_rudder = input[2];
    config.input_throttle = input[3];
    config.input_switch = input[4];
    core::RcChannels rc;
    core::map_channels(decoder, config, rc);
    for (uint8_t i = 0; i < core::kChannels; ++i) {
      CHECK_EQ(rc.width_ticks[i], i == core::kRudder ? 0 : 2000 + 400 * input[i]);
    }
    CHECK_EQ(rc.fresh, 0b1'1011);
    CHECK_EQ(rc.steady, 0);
    send_frame(decoder, 80000);
    send_frame(decoder, 120000);
    core::map_channels(decoder, config, rc);
    CHECK_EQ(rc.steady, 0b1'1011);
    // One input falls silent: its channel is no longer fresh, the others are.
    for (uint32_t at_ticks = 160000; at_ticks < 240000; at_ticks += 40000) {
      const uint8_t quiet = static_cast<uint8_t>(~(1U << shift));
      decoder.edge(at_ticks, kAll & quiet, false);
      for (uint8_t i = 0; i < core::kRcInputs; ++i) {
        decoder.edge(at_ticks + 2000 + uint32_t{400} * i,
                     static_cast<uint8_t>(kAll << (i + 1) & kAll & quiet),
                     false);
      }
      decoder.poll(at_ticks + 8000);
    }
    decoder.poll(120000 + core::RcDecoder::kFreshTicks + 4002);
    core::map_channels(decoder, config, rc);
    CHECK_EQ(rc.fresh, 0b1'1010);  // the first channel is the quiet one
    CHECK_EQ(rc.steady, 0b1'1011);
  }
}
