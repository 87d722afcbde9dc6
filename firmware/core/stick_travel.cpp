#include "core/stick_travel.h"

namespace core {

void StickTravel::look(const RcChannels& rc) {
  for (uint8_t axis = 0; axis < kCardAxes; ++axis) {
    if ((rc.steady >> axis & 1U) == 0) continue;
    const uint16_t above = static_cast<uint16_t>(rc.width_ticks[axis] - RcDecoder::kMinWidthTicks);
    const uint8_t floor = static_cast<uint8_t>(above >> kStepBits);
    const uint8_t ceiling = static_cast<uint8_t>((above + (1U << kStepBits) - 1U) >> kStepBits);
    if (least_[axis] > most_[axis]) {
      // The first look: nothing was shown but this place.
      least_[axis] = ceiling;
      most_[axis] = ceiling;
      continue;
    }
    if (ceiling < least_[axis]) --least_[axis];
    if (floor > most_[axis]) ++most_[axis];
  }
}

bool StickTravel::shown() const {
  for (uint8_t axis = 0; axis < kCardAxes; ++axis) {
    if (least_ticks(axis) + kLeastSpanTicks > most_ticks(axis)) return false;
  }
  return true;
}

bool StickTravel::at_end(uint8_t axis, uint16_t width_ticks) const {
  return width_ticks <= least_ticks(axis) + kEndTicks ||
         width_ticks + kEndTicks >= most_ticks(axis);
}

}  // namespace core
