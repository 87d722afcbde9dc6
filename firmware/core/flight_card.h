// What the bytes of a flight card must say before a row of it is flown: protocol/flight-card.md.
#pragma once

#include <stdint.h>

#include "core/crc.h"
#include "generated/frames.h"

namespace core {

using CardHead = frames::CardHeadLayout;
using CardRow = frames::CardRowLayout;

constexpr uint8_t kCardAxes = 3;  // aileron, elevator, rudder: the servos but the throttle
constexpr uint8_t kCardParts = frames::kCardHeadParts + frames::kCardMostRows +
                               frames::kCardMostAxes * frames::kCardAxisParts + 1;  // card_hold
constexpr uint8_t kHeldAxes = 2;  // aileron by bank, elevator by pitch: as the servos begin
constexpr uint16_t kCardFieldsBytes = offsetof(CardHead, crc);

// What of the head limits its rows.
struct RowLimits {
  uint16_t amplitude_max_us[kCardAxes];
  uint16_t frequency_max_chz;
  bool hold;  // the card has gains
};

// Which axes a row holds, as bits.
inline uint8_t held_axes(const CardRow& row) {
  return static_cast<uint8_t>(row.axes >> frames::kCardHeldShift);
}
inline uint8_t moved_axes(const CardRow& row) {
  return static_cast<uint8_t>(row.axes & ((1U << frames::kCardHeldShift) - 1U));
}

RowLimits row_limits(const CardHead& head);

// Everything but the hash. `aircraft` has the 16 bytes of the setting.
frames::CardFault judge_head(const CardHead& head, const char* aircraft);
// Of a row what it has learned: none of the card's axes, or one of them.
inline bool axis_of_row_good(uint8_t axis_of_row, uint8_t learned_axes) {
  return axis_of_row <= learned_axes;
}
bool row_whole(const CardRow& row);  // its CRC-16 holds
// Its CRC-16 too.
frames::CardFault judge_row(const CardRow& row, const RowLimits& limits);
// What card_hold must say.
bool hold_good(const frames::CardHoldLayout& card, const uint16_t* amplitude_max_us);

}  // namespace core
