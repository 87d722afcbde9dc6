// What the pilot at the field sees and hears. LED: on while ready, slow blinks while recording,
// fast blinks while an open file waits for the throttle, one blink a second that grows longer as
// the work on the card goes on, else groups of flashes that say what is wrong. Buzzer: one long
// tone at the start, two at the end, groups of beeps with the flashes, quick beeps while the
// throttle is above idle and nothing can be recorded. A test input: quick flashes and chirps while
// it runs, one tone once it has taught enough, then quick beeps: 1 done, 2 pilot, 4 receiver or
// relay, 5 a limit left, 6 a sensor, 7 recorder, loop, supply or row; 3: the card is enabled.
#pragma once

#include <stdint.h>

#include "app/recorder.h"
#include "app/test_inputs.h"

namespace app {

class Panel {
 public:
  // `relay_lost`: the relay did not follow the heartbeat.
  void step(const Recorder& recorder, bool relay_lost, TestInputs& inputs, uint32_t now_us);

 private:
  void sound(uint32_t now_us);
  bool show_input(TestInputs& inputs, uint32_t now_us);
  bool alarm(uint32_t now_us);

  uint32_t turned_us_ = 0;
  uint32_t tone_us_ = 0;
  uint8_t flash_ = 0;  // half periods since the group began
  uint8_t tones_ = 0;  // half periods of the tone still to come; kQuick: of quick ones
  bool alarm_on_ = false;
  Recorder::State shown_ = Recorder::State::kNoFile;
};

// Flashes of a group: 2 no card, 3 no FAT32, 4 unreadable, 5 full, 6 no room in one piece,
// 7 card lost while recording, 8 file system damaged; 9, before all others: the relay does not
// follow. 0: nothing is wrong.
uint8_t trouble_flashes(Recorder::State state, storage::VolumeStatus status);

}  // namespace app
