// Button and throttle, stepped every 10 ms.
#include "check.h"
#include "core/recording.h"

namespace {

using core::BootAction;
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

TEST_CASE("an unclosed file: throttle above idle, a reset mark or a press resume it at once") {
  const core::PilotInputs idle = {false, true, true};
  const core::PilotInputs high = {false, true, false};
  core::BootControl by_throttle;
  CHECK(by_throttle.update(idle, false, 0) == BootAction::kWait);
  CHECK(by_throttle.update(high, false, 5000) == BootAction::kResume);
  core::BootControl by_mark;
  by_mark.start(true);
  CHECK(by_mark.update(idle, false, 0) == BootAction::kResume);
  core::BootControl by_press;
  CHECK(by_press.update(idle, true, 0) == BootAction::kResume);
}

TEST_CASE("idle throttle of before the flight does not count behind it") {
  core::BootControl boot;
  uint32_t now_us = 0;
  for (; now_us < 5000000U; now_us += 10000U) {
    CHECK(boot.update({false, true, true}, false, now_us) == core::BootAction::kWait);
  }
  for (; now_us < 60000000U; now_us += 10000U) {
    CHECK(boot.update({false, true, false}, false, now_us) == core::BootAction::kResume);
  }
  CHECK(boot.update({false, true, true}, false, now_us) == core::BootAction::kWait);
  CHECK(boot.update({false, true, true}, false, now_us + 9900000U) == core::BootAction::kWait);
  CHECK(boot.update({false, true, true}, false, now_us + 10000000U) == core::BootAction::kClose);
}

TEST_CASE("it is closed after 10 s of valid idle throttle without a break, never before") {
  core::BootControl boot;
  const core::PilotInputs idle = {false, true, true};
  const core::PilotInputs lost = {false, false, false};
  const uint32_t start_us = 0xFFFF0000U;
  CHECK(boot.update(lost, false, start_us) == BootAction::kWait);
  CHECK(boot.update(lost, false, start_us + 60000000U) == BootAction::kWait);
  const uint32_t idle_us = start_us + 61000000U;
  CHECK(boot.update(idle, false, idle_us) == BootAction::kWait);
  CHECK(boot.update(idle, false, idle_us + 9000000U) == BootAction::kWait);
  CHECK(boot.update(lost, false, idle_us + 9500000U) == BootAction::kWait);
  CHECK(boot.update(idle, false, idle_us + 11000000U) == BootAction::kWait);
  CHECK(boot.update(idle, false, idle_us + 20999999U) == BootAction::kWait);
  CHECK(boot.update(idle, false, idle_us + 21000000U) == BootAction::kClose);
}
