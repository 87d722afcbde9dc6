// How far the pilot moved each surface's stick on the ground since the reset: no input goes beyond.
// In steps of 8 us, rounded inwards. It widens by one step a look, so that a spoilt pulse adds
// 8 us and not its own width; a stick held at its end for half a second shows all of it.
#pragma once

#include <stdint.h>

#include "core/drive.h"
#include "core/flight_card.h"

namespace core {

class StickTravel {
 public:
  static constexpr uint16_t kLeastSpanTicks = 200U * kTicksPerUs;  // shows that the stick was moved
  static constexpr uint16_t kEndTicks = 32U * kTicksPerUs;         // this near is at the end

  // On the ground, with steady pulses.
  void look(const RcChannels& rc);

  // Ticks of 0.5 us; of an axis never seen the least is above the most.
  uint16_t least_ticks(uint8_t axis) const { return to_ticks(least_[axis]); }
  uint16_t most_ticks(uint8_t axis) const { return to_ticks(most_[axis]); }
  // Every axis was moved by 200 us or more.
  bool shown() const;
  bool at_end(uint8_t axis, uint16_t width_ticks) const;
  bool above_middle(uint8_t axis, uint16_t width_ticks) const {
    return 2U * width_ticks > static_cast<uint32_t>(least_ticks(axis)) + most_ticks(axis);
  }

 private:
  static constexpr uint8_t kStepBits = 4;
  static uint16_t to_ticks(uint8_t step) {
    return static_cast<uint16_t>(RcDecoder::kMinWidthTicks +
                                 (static_cast<uint16_t>(step) << kStepBits));
  }

  uint8_t least_[kCardAxes] = {0xFF, 0xFF, 0xFF};
  uint8_t most_[kCardAxes] = {};
};

// The pilot's sign that the card may be flown: held for 3 s without a break.
class HeldSign {
 public:
  static constexpr uint32_t kHoldUs = 3000000;

  // True once, when it was held long enough.
  bool look(bool held, uint32_t now_us) {
    if (!held) {
      since_ = kNotHeld;
      return false;
    }
    // The bit keeps a time from the two values that say something else.
    const uint16_t now = static_cast<uint16_t>((now_us >> kShift) | kTime);
    if (since_ == kNotHeld) since_ = now;
    if (since_ == kTold || static_cast<uint16_t>(now - since_) < kHoldUs >> kShift) return false;
    since_ = kTold;
    return true;
  }

 private:
  static constexpr uint8_t kShift = 10;  // about a millisecond
  static constexpr uint16_t kNotHeld = 0;
  static constexpr uint16_t kTold = 1;
  static constexpr uint16_t kTime = 2;

  uint16_t since_ = kNotHeld;
};

}  // namespace core
