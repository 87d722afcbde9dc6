#include "core/flight_card.h"

#include <string.h>

namespace core {
namespace {

using frames::CardFault;
using frames::CardShape;

constexpr uint16_t kLeastPulseUs = 800;
constexpr uint16_t kMostPulseUs = 2200;
constexpr uint16_t kMostBank = 18000;
constexpr uint16_t kMostRate = 32767;
constexpr uint16_t kNoInput = 255;
constexpr uint8_t kComponentBytes = 3;
constexpr uint8_t kShareMask = 0x3F;
constexpr uint8_t kAxisShift = 6;
constexpr uint16_t kMostShares = 252;  // the sum stays within 32 bits

bool within(uint16_t value, uint16_t least, uint16_t most) {
  return value >= least && value <= most;
}

bool pair(uint16_t least, uint16_t most) {
  return least <= most;
}

bool input_is(uint8_t input, uint8_t first) {
  return input == kNoInput || input == first || input == first + 1;
}

bool servos_good(const CardHead& head) {
  for (uint8_t axis = 0; axis < kCardAxes; ++axis) {
    if (!within(head.servo_min_us[axis], kLeastPulseUs, head.servo_max_us[axis]) ||
        head.servo_max_us[axis] > kMostPulseUs ||
        head.amplitude_max_us[axis] > frames::kCardMostAmplitudeUs) {
      return false;
    }
  }
  return true;
}

bool reserved_is_zero(const CardHead& head) {
  uint8_t bits = 0;
  for (uint8_t i = 0; i < sizeof head.reserved_2; ++i) {
    bits = static_cast<uint8_t>(bits | head.reserved_2[i]);
  }
  return bits == 0;
}

bool limits_good(const CardHead& head) {
  return input_is(head.airspeed_input, 4) && input_is(head.alpha_input, 0) &&
         input_is(head.beta_input, 2) && pair(head.dp_min, head.dp_max) &&
         pair(head.alpha_min, head.alpha_max) && pair(head.beta_min, head.beta_max) &&
         head.phi_max <= kMostBank && head.theta_min <= head.theta_max && head.p_max <= kMostRate &&
         head.q_max <= kMostRate && head.r_max <= kMostRate && head.az_min <= head.az_max &&
         within(head.height_min_pa, frames::kCardLeastHeightPa, head.height_max_pa) &&
         head.distance_max_m <= frames::kCardMostDistanceM && within(head.still_ms, 100, 2000) &&
         within(head.stick_us, 10, 200) && servos_good(head) &&
         within(head.rate_max_usps, 100, 60000U) &&
         within(head.frequency_max_chz, 1, frames::kCardMostFrequencyChz) &&
         head.learned_axes <= frames::kCardMostAxes && head.hold <= 1 && reserved_is_zero(head);
}

// `parts` of the fastest period in duration_ms: its frequency in 0.01 Hz is 50000 * parts / T.
bool slow_enough(uint32_t parts, uint16_t duration_ms, uint16_t most_chz) {
  return 50000U * parts <= static_cast<uint32_t>(most_chz) * duration_ms;
}

bool components_are_zero(const CardRow& row, uint8_t from) {
  for (uint8_t i = from; i < sizeof row.components; ++i) {
    if (row.components[i] != 0) return false;
  }
  return true;
}

CardFault judge_components(const CardRow& row, uint16_t most_chz) {
  uint16_t shares[kCardAxes] = {};
  uint8_t i = 0;
  for (; i < sizeof row.components && row.components[i] != 0;
       i = static_cast<uint8_t>(i + kComponentBytes)) {
    const uint8_t axis = static_cast<uint8_t>(row.components[i + 2] >> kAxisShift);
    const uint8_t share = row.components[i + 2] & kShareMask;
    if (axis >= kCardAxes || (row.axes >> axis & 1U) == 0 || share == 0) {
      return CardFault::kRowComponents;
    }
    shares[axis] = static_cast<uint16_t>(shares[axis] + share);
    if (!slow_enough(2U * row.components[i], row.duration_ms, most_chz)) {
      return CardFault::kRowFrequency;
    }
  }
  if (!components_are_zero(row, i)) return CardFault::kRowComponents;
  for (uint8_t axis = 0; axis < kCardAxes; ++axis) {
    const bool moved = (row.axes >> axis & 1U) != 0;
    if (shares[axis] > kMostShares || moved != (shares[axis] != 0)) {
      return CardFault::kRowComponents;
    }
  }
  return CardFault::kNone;
}

CardFault judge_frequency(const CardRow& row, CardShape shape, uint16_t most_chz) {
  if (shape == CardShape::kSweep) {
    const bool good = within(row.first_chz, 1, most_chz) && within(row.last_chz, 1, most_chz);
    return good ? CardFault::kNone : CardFault::kRowFrequency;
  }
  if (row.first_chz != 0 || row.last_chz != 0) return CardFault::kRowFrequency;
  uint8_t parts = 1;
  if (shape == CardShape::kDoublet) parts = 2;
  if (shape == CardShape::kThreeTwoOneOne) parts = 7;
  if (shape == CardShape::kMultisine) return judge_components(row, most_chz);
  return slow_enough(parts, row.duration_ms, most_chz) ? CardFault::kNone
                                                       : CardFault::kRowFrequency;
}

bool same_sense(int16_t gain, int16_t other) {
  return other == 0 || (gain < 0) == (other < 0);
}

CardFault judge_axes(const CardRow& row, const RowLimits& limits) {
  const uint8_t moved = moved_axes(row);
  const uint8_t held = held_axes(row);
  if (moved == 0 || moved >= 1U << kCardAxes) return CardFault::kRowAxes;
  if (held >= 1U << kHeldAxes || (held & moved) != 0 || (held != 0 && !limits.hold)) {
    return CardFault::kRowHold;
  }
  for (uint8_t axis = 0; axis < kCardAxes; ++axis) {
    const int16_t amplitude_us = row.amplitude_us[axis];
    if (((moved >> axis & 1U) != 0) != (amplitude_us != 0)) return CardFault::kRowAxes;
    const int32_t most_us = limits.amplitude_max_us[axis];
    if (amplitude_us > most_us || amplitude_us < -most_us) return CardFault::kRowAmplitude;
  }
  return CardFault::kNone;
}

}  // namespace

RowLimits row_limits(const CardHead& head) {
  RowLimits limits = {};
  for (uint8_t axis = 0; axis < kCardAxes; ++axis) {
    limits.amplitude_max_us[axis] = head.amplitude_max_us[axis];
  }
  limits.frequency_max_chz = head.frequency_max_chz;
  limits.hold = head.hold != 0;
  return limits;
}

CardFault judge_head(const CardHead& head, const char* aircraft) {
  if (head.magic != frames::kCardHeadLayoutMagic) return CardFault::kMagic;
  if (head.version != frames::kCardHeadLayoutVersion) return CardFault::kOtherVersion;
  if (!within(head.rows, 1, frames::kCardMostRows)) return CardFault::kRows;
  if (memcmp(head.aircraft, aircraft, sizeof head.aircraft) != 0) return CardFault::kAircraft;
  return limits_good(head) ? CardFault::kNone : CardFault::kLimits;
}

bool hold_good(const frames::CardHoldLayout& card, const uint16_t* amplitude_max_us) {
  uint8_t bits = 0;
  for (const uint8_t byte : card.reserved) bits = static_cast<uint8_t>(bits | byte);
  for (uint8_t axis = 0; axis < kHeldAxes; ++axis) {
    const int16_t gain = card.angle_gain[axis];
    // -32768 has no opposite.
    if (gain == 0 || gain == INT16_MIN || card.rate_gain[axis] == INT16_MIN ||
        !same_sense(gain, card.integral_gain[axis]) || !same_sense(gain, card.rate_gain[axis]) ||
        card.authority_us[axis] == 0 || card.authority_us[axis] > amplitude_max_us[axis]) {
      return false;
    }
  }
  return bits == 0;
}

bool row_whole(const CardRow& row) {
  const uint8_t* const bytes = reinterpret_cast<const uint8_t*>(&row);
  return crc16(kCrc16Start, bytes, offsetof(CardRow, crc)) == row.crc;
}

CardFault judge_row(const CardRow& row, const RowLimits& limits) {
  if (!row_whole(row)) return CardFault::kRowCrc;
  const CardShape shape = static_cast<CardShape>(row.shape);
  if (row.shape < static_cast<uint8_t>(CardShape::kPulse) ||
      row.shape > static_cast<uint8_t>(CardShape::kMultisine) ||
      (shape != CardShape::kMultisine && !components_are_zero(row, 0))) {
    return CardFault::kRowShape;
  }
  const CardFault axes = judge_axes(row, limits);
  if (axes != CardFault::kNone) return axes;
  if (!within(row.duration_ms, frames::kCardLeastMs, frames::kCardLongestMs) ||
      row.quiet_ms > frames::kCardLongestMs - row.duration_ms) {
    return CardFault::kRowTime;
  }
  return judge_frequency(row, shape, limits.frequency_max_chz);
}

}  // namespace core
