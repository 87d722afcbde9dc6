// When recording starts, stops, resumes: button and throttle in, decision out.
#pragma once

#include <stdint.h>

#include "core/airborne.h"

namespace core {

struct PilotInputs {
  bool button_down;
  bool throttle_valid;  // its pulses are steady
  bool throttle_idle;   // at or below the setting; meaningless while not valid
};

enum class RecordAction : uint8_t { kNone, kStartButton, kStartThrottle, kStop, kMark };

// Start: a press, or throttle above idle for 1 s. Stop: a 2 s press with throttle idle (or with a
// receiver that was never heard: a bare board on the bench). A short press while recording is a
// mark. A button that is down at boot counts only after it was let go.
class RecordControl {
 public:
  RecordAction update(const PilotInputs& in, bool recording, bool auto_start, uint32_t now_us);
  // Length of a press that just ended, for the event `button`; 0 else.
  uint16_t take_press_ms();

 private:
  RecordAction button(bool raw_down, bool recording, bool may_stop, uint32_t now_us);
  RecordAction press(bool recording, uint32_t now_us);
  RecordAction let_go(bool recording, uint32_t now_us);

  uint32_t changed_us_ = 0;  // the raw button moved
  uint32_t pressed_us_ = 0;
  uint32_t throttle_us_ = 0;
  uint16_t press_ms_ = 0;
  bool raw_down_ = true;
  bool down_ = true;
  bool spent_ = true;     // this press has had its effect
  bool pressed_ = false;  // a press since boot
  bool throttle_high_ = false;
  bool throttle_seen_ = false;
};

enum class BootAction : uint8_t { kWait, kResume, kClose };

// What to do with a file that an earlier power-on left open. Closing it writes metadata, so that
// waits until it is the ground for sure (core/airborne.h); continuing it writes none.
//
//   seen                                                        then
//   the mark of a reset, a card that comes back, a press,       continue at once
//   throttle above idle, flying
//   8 s ago somebody said moving, and it is not yet the ground  continue: in doubt
//   the ground                                                  close
class BootControl {
 public:
  static constexpr uint32_t kDoubtUs = 8000000UL;

  void start(bool resume) {
    resume_ = resume;
    doubt_ = false;
  }
  // `moves`: Airborne::moves().
  BootAction update(
      const PilotInputs& in, bool start_pressed, FlightState flight, bool moves, uint32_t now_us);

 private:
  uint32_t doubt_us_ = 0;  // the first said so
  bool doubt_ = false;
  bool resume_ = false;
};

}  // namespace core
