// Button and throttle, stepped every 10 ms.
#include "check.h"
#include "core/recording.h"

namespace {

using core::BootAction;
using core::FlightState;
using core::RecordAction;

struct Pilot {
  core::RecordControl control;
  core::PilotInputs in = {false, true, true};
  bool recording = false;
  bool auto_start = true;
  uint32_t now_us = 0xFFFFFFFFU - 500000U;

  // The last action within the time; recording follows it.
  RecordAction run_ms(uint16_t ms) {
    RecordAction last = RecordAction::kNone;
    for (; ms >= 10; ms = static_cast<uint16_t>(ms - 10)) {
      now_us += 10000;
      const RecordAction action = control.update(in, recording, auto_start, now_us);
      if (action == RecordAction::kNone) {
        continue;
      }
      last = action;
      if (action != RecordAction::kMark) {
        recording = action != RecordAction::kStop;
      }
    }
    return last;
  }
  RecordAction press_ms(uint16_t ms) {
    in.button_down = true;
    const RecordAction while_down = run_ms(ms);
    in.button_down = false;
    const RecordAction behind = run_ms(100);
    return while_down != RecordAction::kNone ? while_down : behind;
  }
};

}  // namespace

TEST_CASE("a press starts, and going on holding it does not stop") {
  Pilot pilot;
  pilot.run_ms(100);
  CHECK(pilot.press_ms(4000) == RecordAction::kStartButton);
  CHECK(pilot.recording);
}

TEST_CASE("a press of 2 s with throttle idle stops; shorter ones are marks") {
  Pilot pilot;
  pilot.run_ms(100);
  pilot.press_ms(200);
  CHECK(pilot.press_ms(1900) == RecordAction::kMark);
  CHECK(pilot.recording);
  CHECK(pilot.press_ms(2100) == RecordAction::kStop);
  CHECK(!pilot.recording);
}

TEST_CASE("with throttle above idle, or lost in flight, no press stops") {
  Pilot pilot;
  pilot.auto_start = false;
  pilot.run_ms(100);
  pilot.press_ms(200);
  pilot.in.throttle_idle = false;
  CHECK(pilot.press_ms(5000) == RecordAction::kNone);
  pilot.in.throttle_valid = false;
  CHECK(pilot.press_ms(5000) == RecordAction::kNone);
  CHECK(pilot.recording);
}

TEST_CASE("a bare board without receiver starts and stops by button") {
  Pilot pilot;
  pilot.in.throttle_valid = false;
  pilot.run_ms(100);
  CHECK(pilot.press_ms(200) == RecordAction::kStartButton);
  CHECK(pilot.press_ms(2100) == RecordAction::kStop);
}

TEST_CASE("throttle above idle for 1 s without a break starts, once") {
  Pilot pilot;
  pilot.run_ms(100);
  pilot.in.throttle_idle = false;
  CHECK(pilot.run_ms(900) == RecordAction::kNone);
  pilot.in.throttle_idle = true;
  pilot.run_ms(50);
  pilot.in.throttle_idle = false;
  CHECK(pilot.run_ms(1000) == RecordAction::kNone);
  CHECK(pilot.run_ms(100) == RecordAction::kStartThrottle);
  CHECK(pilot.run_ms(3000) == RecordAction::kNone);
}

TEST_CASE("throttle does not start when that is switched off, nor while it is invalid") {
  Pilot pilot;
  pilot.auto_start = false;
  pilot.in.throttle_idle = false;
  CHECK(pilot.run_ms(3000) == RecordAction::kNone);
  pilot.auto_start = true;
  pilot.in.throttle_valid = false;
  CHECK(pilot.run_ms(3000) == RecordAction::kNone);
}

TEST_CASE("a bouncing button is one press") {
  Pilot pilot;
  pilot.run_ms(100);
  for (uint8_t i = 0; i < 6; ++i) {
    pilot.in.button_down = i % 2 == 0;
    CHECK(pilot.run_ms(20) == RecordAction::kNone);
  }
  CHECK(pilot.press_ms(100) == RecordAction::kStartButton);
}

TEST_CASE("a button stuck since boot does nothing until it was let go") {
  Pilot pilot;
  pilot.in.button_down = true;
  CHECK(pilot.run_ms(5000) == RecordAction::kNone);
  pilot.in.button_down = false;
  CHECK(pilot.run_ms(100) == RecordAction::kNone);
  CHECK_EQ(pilot.control.take_press_ms(), 0);
  CHECK(pilot.press_ms(100) == RecordAction::kStartButton);
}

TEST_CASE("the length of a press is told once") {
  Pilot pilot;
  pilot.run_ms(100);
  pilot.press_ms(700);
  CHECK_EQ(pilot.control.take_press_ms(), 700);
  CHECK_EQ(pilot.control.take_press_ms(), 0);
}

namespace {

const core::PilotInputs kIdle = {false, true, true};
const core::PilotInputs kHigh = {false, true, false};
const core::PilotInputs kLost = {false, false, false};

}  // namespace

TEST_CASE("an unclosed file: throttle above idle, a mark, a press or flying continue it at once") {
  core::BootControl by_throttle;
  CHECK(by_throttle.update(kIdle, false, FlightState::kInDoubt, false, 0) == BootAction::kWait);
  CHECK(by_throttle.update(kHigh, false, FlightState::kInDoubt, false, 5000) ==
        BootAction::kResume);
  core::BootControl by_mark;
  by_mark.start(true);
  CHECK(by_mark.update(kIdle, false, FlightState::kInDoubt, false, 0) == BootAction::kResume);
  core::BootControl by_press;
  CHECK(by_press.update(kIdle, true, FlightState::kInDoubt, false, 0) == BootAction::kResume);
  core::BootControl by_flying;
  CHECK(by_flying.update(kLost, false, FlightState::kFlying, true, 0) == BootAction::kResume);
}

TEST_CASE("neither an idle throttle nor a silent receiver closes it: the ground does") {
  core::BootControl boot;
  const uint32_t start_us = 0xFFFF0000U;
  for (uint32_t at_us = 0; at_us < 60000000U; at_us += 10000U) {
    const core::PilotInputs& in = at_us < 3000000U ? kLost : kIdle;
    CHECK(boot.update(in, false, FlightState::kInDoubt, false, start_us + at_us) ==
          BootAction::kWait);
  }
  CHECK(boot.update(kIdle, false, FlightState::kGround, false, start_us + 60000000U) ==
        BootAction::kClose);
}

TEST_CASE("in doubt it is continued 8 s after the first that moved, unless it is the ground") {
  core::BootControl boot;
  uint32_t now_us = 0xFFFFFFFFU - 2000000U;
  CHECK(boot.update(kIdle, false, FlightState::kInDoubt, true, now_us) == BootAction::kWait);
  now_us += 7990000U;
  CHECK(boot.update(kIdle, false, FlightState::kInDoubt, false, now_us) == BootAction::kWait);
  CHECK(boot.update(kIdle, false, FlightState::kGround, false, now_us) == BootAction::kClose);
  now_us += 10000U;
  CHECK(boot.update(kIdle, false, FlightState::kInDoubt, false, now_us) == BootAction::kResume);
}
