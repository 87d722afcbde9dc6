// Button, throttle and the file left open, at the very limits of their times.
#include "check.h"
#include "core/recording.h"

namespace {

using core::BootAction;
using core::FlightState;
using core::RecordAction;

const core::PilotInputs kIdle = {false, true, true};
const core::PilotInputs kHigh = {false, true, false};
const core::PilotInputs kLost = {false, false, true};
const core::PilotInputs kLostHigh = {false, false, false};

struct Desk {
  core::RecordControl control;
  core::PilotInputs in = kIdle;
  bool recording = false;
  bool auto_start = true;
  uint32_t now_us = 0xFFFFFFFFU - 50000U;

  Desk() { set(false); }

  RecordAction turn(uint32_t later_us) {
    now_us += later_us;
    return control.update(in, recording, auto_start, now_us);
  }
  // The button moves and is believed 30 ms later.
  RecordAction set(bool down) {
    in.button_down = down;
    turn(0);
    return turn(30000);
  }
};

}  // namespace

TEST_CASE("a press is believed after 30 ms, not a microsecond before") {
  Desk desk;
  desk.in.button_down = true;
  CHECK(desk.turn(1000) == RecordAction::kNone);
  CHECK(desk.turn(29999) == RecordAction::kNone);
  CHECK(desk.turn(1) == RecordAction::kStartButton);
  CHECK(desk.turn(1) == RecordAction::kNone);
}

TEST_CASE("turns that come late miss neither the press nor the throttle's second") {
  Desk desk;
  desk.in.button_down = true;
  desk.turn(1000);
  CHECK(desk.turn(31000) == RecordAction::kStartButton);
  Desk other;
  other.in = kHigh;
  other.turn(1000);
  CHECK(other.turn(1000700) == RecordAction::kStartThrottle);
}

TEST_CASE("a bounce begins the 30 ms anew") {
  Desk desk;
  desk.in.button_down = true;
  desk.turn(1000);
  desk.turn(20000);
  desk.in.button_down = false;
  desk.turn(1000);
  desk.in.button_down = true;
  CHECK(desk.turn(15000) == RecordAction::kNone);
  CHECK(desk.turn(29999) == RecordAction::kNone);
  CHECK(desk.turn(1) == RecordAction::kStartButton);
}

TEST_CASE("2 s of press stop, not a microsecond less, and only once") {
  Desk desk;
  desk.recording = true;
  CHECK(desk.set(true) == RecordAction::kNone);
  CHECK(desk.turn(1999999) == RecordAction::kNone);
  CHECK(desk.turn(1) == RecordAction::kStop);
  CHECK(desk.turn(5000000) == RecordAction::kNone);
  CHECK(desk.set(false) == RecordAction::kNone);
}

TEST_CASE("a press just below 2 s is a mark, one of 2 s that could not stop is none") {
  Desk desk;
  desk.recording = true;
  desk.in = kHigh;
  desk.set(true);
  desk.turn(1969999);
  CHECK(desk.set(false) == RecordAction::kMark);
  desk.set(true);
  desk.turn(1970000);
  CHECK(desk.set(false) == RecordAction::kNone);
  CHECK(desk.turn(5000000) == RecordAction::kNone);  // let go: time does not stop it
}

TEST_CASE("a long press stops as soon as the throttle is idle") {
  Desk desk;
  desk.recording = true;
  desk.in = kHigh;
  desk.set(true);
  CHECK(desk.turn(3000000) == RecordAction::kNone);
  desk.in.throttle_idle = true;
  CHECK(desk.turn(1) == RecordAction::kStop);
}

TEST_CASE("a press that started is no mark; with nothing recorded a long one stops nothing") {
  Desk desk;
  CHECK(desk.set(true) == RecordAction::kStartButton);
  desk.recording = true;
  CHECK(desk.set(false) == RecordAction::kNone);
  CHECK(desk.set(true) == RecordAction::kNone);
  desk.recording = false;  // it ended for another cause
  CHECK(desk.turn(3000000) == RecordAction::kNone);
  CHECK(desk.set(false) == RecordAction::kNone);
}

TEST_CASE("a receiver once heard and then lost forbids the stop; one never heard does not") {
  Desk lost;
  lost.recording = true;
  lost.in = kLost;
  lost.set(true);
  CHECK(lost.turn(3000000) == RecordAction::kNone);
  core::RecordControl bare;
  core::PilotInputs in = kLostHigh;
  bare.update(in, true, true, 0);
  bare.update(in, true, true, 30000);
  in.button_down = true;
  bare.update(in, true, true, 40000);
  bare.update(in, true, true, 70000);
  CHECK(bare.update(in, true, true, 2070000) == RecordAction::kStop);
}

TEST_CASE("1 s of throttle starts, not a microsecond less, and not while it records") {
  Desk desk;
  desk.in = kHigh;
  CHECK(desk.turn(1000) == RecordAction::kNone);
  CHECK(desk.turn(999999) == RecordAction::kNone);
  desk.recording = true;
  CHECK(desk.turn(1) == RecordAction::kNone);
  desk.recording = false;
  CHECK(desk.turn(0) == RecordAction::kStartThrottle);
  desk.auto_start = false;
  CHECK(desk.turn(0) == RecordAction::kNone);
}

TEST_CASE("throttle lost on the way begins its second anew") {
  Desk desk;
  desk.in = kHigh;
  desk.turn(1000);
  desk.turn(900000);
  desk.in = kLostHigh;
  desk.turn(10000);
  desk.in = kHigh;
  desk.turn(1000);
  CHECK(desk.turn(999999) == RecordAction::kNone);
  CHECK(desk.turn(1) == RecordAction::kStartThrottle);
}

TEST_CASE("a press and the throttle at once: the press is what started it") {
  Desk desk;
  desk.in = kHigh;
  desk.turn(0);
  desk.turn(969999);
  desk.in.button_down = true;
  CHECK(desk.turn(1) == RecordAction::kNone);
  CHECK(desk.turn(30000) == RecordAction::kStartButton);
  CHECK(desk.turn(0) == RecordAction::kStartThrottle);
}

TEST_CASE("the length of a press is in whole milliseconds, and at most what 16 bits hold") {
  const uint32_t held_us[] = {30000, 30999, 31000, 65535999, 65536000, 90000000};
  const uint16_t told_ms[] = {30, 30, 31, 65535, 65535, 65535};
  for (uint8_t i = 0; i < 6; ++i) {
    Desk desk;
    desk.set(true);
    desk.turn(held_us[i] - 30000);
    CHECK_EQ(desk.control.take_press_ms(), 0);
    desk.set(false);
    CHECK_EQ(desk.control.take_press_ms(), told_ms[i]);
  }
}

TEST_CASE("the doubt counts 8 s from the first that moved, to the microsecond") {
  core::BootControl boot;
  const uint32_t start_us = 0xFFFFFFFFU - 3000000U;
  CHECK(boot.update(kIdle, false, FlightState::kInDoubt, true, start_us) == BootAction::kWait);
  const uint32_t last_us = start_us + core::BootControl::kDoubtUs - 1;
  CHECK(boot.update(kIdle, false, FlightState::kInDoubt, true, last_us) == BootAction::kWait);
  CHECK(boot.update(kLostHigh, false, FlightState::kInDoubt, false, last_us) == BootAction::kWait);
  CHECK(boot.update(kIdle, false, FlightState::kInDoubt, true, last_us + 1) == BootAction::kResume);
  CHECK(boot.update(kIdle, false, FlightState::kInDoubt, false, last_us + 9) ==
        BootAction::kResume);
  boot.start(false);
  CHECK(boot.update(kIdle, false, FlightState::kInDoubt, true, last_us + 2) == BootAction::kWait);
  boot.start(true);
  CHECK(boot.update(kIdle, false, FlightState::kGround, false, last_us) == BootAction::kResume);
}

TEST_CASE("each cause alone continues the file even on the ground") {
  core::BootControl boot;
  CHECK(boot.update(kHigh, false, FlightState::kGround, false, 0) == BootAction::kResume);
  CHECK(boot.update(kIdle, true, FlightState::kGround, false, 0) == BootAction::kResume);
  CHECK(boot.update(kLostHigh, false, FlightState::kGround, true, 0) == BootAction::kClose);
}
