// Who is in command while a flight card is enabled: the table in core/README.md. Behind the drive:
// it adds to what DriveControl lets through, never to the throttle, and takes nothing away.
#pragma once

#include <stdint.h>

#include "core/drive.h"
#include "core/flight_card.h"
#include "core/stick_travel.h"

namespace core {

// Where the switch stands for the inputs. Direct, lost and everything below Mega is kOther.
enum class SwitchPlace : uint8_t { kOther, kMega, kBetween, kArmed };

// Mega ends kLeastSwitchGapUs below armed: a pulse that trembles at one limit is not at the other.
SwitchPlace switch_place(uint16_t width_ticks,
                         uint16_t switch_mega_min_us,
                         uint16_t switch_armed_min_us);

// What an input needs while it runs, and only then: lent memory (app/outlet.h).
struct InputMemory {
  // As the frame `card` tells it.
  uint32_t t_us;
  uint8_t part;
  CardRow row;
  uint16_t stick_ticks[kServos];     // at the trigger
  int16_t applied_ticks[kCardAxes];  // deflection in force
  uint16_t frame_us;                 // of the receiver, at the trigger
  uint16_t looked_us;                // low half of the last look's time
  uint16_t steered_us;               // of the last deflections, a whole ms behind the trigger
  uint8_t dropped;                   // low byte of the frames dropped, at the trigger
  uint8_t open_looks;                // in a row at an open contact
  uint16_t rate_max_usps;            // of the card
  uint16_t elapsed_ms;               // since the trigger, when last steered
  uint32_t turns;                    // turns_per_ms()
};

static_assert(offsetof(InputMemory, part) == offsetof(frames::CardFrame, part) &&
                  offsetof(InputMemory, row) == offsetof(frames::CardFrame, bytes) &&
                  sizeof(CardRow) == sizeof(frames::CardFrame::bytes),
              "a frame without another copy of the row");

// What is known at a look, beside the sensors.
struct InputFacts {
  const RcChannels* rc;
  frames::Drive drive;
  SwitchPlace place;
  uint16_t frame_us;   // 0: not known
  uint16_t silent_us;  // since the oldest of the five channels' last accepted pulses rose
  uint16_t stick_us;   // of the card
  uint8_t dropped;
  bool contact;  // the relay's, closed
  bool button;
  bool throttle_idle;
  bool flying;   // beyond doubt (flying_proof.h)
  bool supply;   // good
  bool records;  // a session, into a card that takes it
};

class InputCommand {
 public:
  static constexpr uint32_t kMegaUs = 500000;
  static constexpr uint32_t kArmedUs = 300000;
  // Looks are 10 ms apart, with the longest turn of the loop 13 ms.
  static constexpr uint16_t kLateUs = 18000;
  static constexpr uint8_t kOpenLooks = 2;     // a contact bounces for 1 ms
  static constexpr uint16_t kSteerUs = 15000;  // a servo takes one pulse in 20 ms

  enum class State : uint8_t { kOff, kWaiting, kAtMega, kReady, kAtArmed, kRunning, kSpent };

  void enable() {
    state_ = State::kSpent;
    row_ = 0;
  }
  void disable() { state_ = State::kOff; }

  State state() const { return state_; }
  bool enabled() const { return state_ != State::kOff; }
  bool armed() const { return state_ == State::kAtArmed; }
  bool running() const { return state_ == State::kRunning; }
  // The memory is in use: from the switch's coming to Mega to the end of the input.
  bool uses_memory() const {
    return state_ == State::kAtMega || state_ == State::kReady || state_ == State::kAtArmed ||
           state_ == State::kRunning;
  }
  uint8_t row() const { return row_; }  // of the card, that the next trigger flies

  // While it is not running. True: the trigger is complete; start() or refuse() must follow.
  bool trigger(SwitchPlace place, bool mega_drives, uint32_t now_us);
  // The row stands in the memory and is good; passes(facts) and the sensors let it.
  void start(InputMemory& memory, const InputFacts& facts, uint32_t now_us);
  void refuse() { state_ = State::kSpent; }

  // May it be flown? Without what only a running input knows.
  static frames::InputEnd passes(const InputFacts& facts);
  // May it go on? kDone: yes. Behind the end of the row: kDone too, and over() is true.
  frames::InputEnd keeps(InputMemory& memory, const InputFacts& facts, uint32_t now_us) const;
  bool over(const InputMemory& memory, uint32_t now_us) const;
  // The deflections for now, if it is time: towards the shape, no faster than the card's rate.
  void steer(InputMemory& memory, uint32_t now_us) const;
  // Ends at once; the next trigger flies the row behind. `rows`: of the card.
  void end(uint8_t rows);
  uint32_t since_us() const { return since_us_; }  // of a running input: its trigger

 private:
  void go(State state, uint32_t now_us) {
    state_ = state;
    since_us_ = now_us;
  }

  uint32_t since_us_ = 0;
  State state_ = State::kOff;
  uint8_t row_ = 0;
};

inline uint16_t apart(uint16_t a, uint16_t b) {
  return a > b ? static_cast<uint16_t>(a - b) : static_cast<uint16_t>(b - a);
}
// What a rate allows in a time, less by 0.2 ticks at most.
uint16_t ticks_at(uint16_t rate_usps, uint16_t rest_us);
int16_t towards(int16_t from, int16_t to, uint16_t most);

// `base` with a deflection above or below zero added, up or down to a limit; a base beyond it is
// left where it is. Widths of 0.5 us, deflections of at most 1000: no sum leaves 16 bits.
uint16_t add_up_to(uint16_t base_ticks, int16_t deflection_ticks, uint16_t most_ticks);
uint16_t add_down_to(uint16_t base_ticks, int16_t deflection_ticks, uint16_t least_ticks);

}  // namespace core
