#include "app/card_store.h"

#include "core/learning/axis_card.h"

namespace app {

using core::CardHead;
using core::CardRow;
using frames::CardFault;

namespace {

void add_bytes(core::Crc32* crc, uint16_t address, uint16_t size) {
  for (; size != 0; --size) {
    const uint8_t byte = hal::read_eeprom(address++);
    crc->add(&byte, 1);
  }
}

bool hash_holds(const CardHead& head) {
  core::Crc32 crc;
  crc.add(&head, core::kCardFieldsBytes);
  const uint8_t parts =
      static_cast<uint8_t>(frames::kCardHeadParts - 2U + head.rows +
                           frames::kCardAxisParts * head.learned_axes + head.hold);
  add_bytes(&crc, card_part_address(2), static_cast<uint16_t>(parts * frames::kCardPartBytes));
  return head.crc != 0 && crc.value() == head.crc;
}

// Apart, so that head and row never lie on the stack together.
__attribute__((noinline)) CardFault judge_card_head(const char* aircraft, core::RowLimits* limits) {
  CardHead head;
  read_card(0, &head, sizeof head);
  const CardFault fault = core::judge_head(head, aircraft);
  if (fault != CardFault::kNone && fault != CardFault::kAircraft && fault != CardFault::kLimits) {
    return fault;
  }
  // More axes than a card has room for: their bytes would be read from behind the EEPROM.
  if (head.learned_axes > frames::kCardMostAxes || head.hold > 1) return CardFault::kLimits;
  if (!hash_holds(head)) return CardFault::kCrc;
  *limits = core::row_limits(head);
  return fault;
}

__attribute__((noinline)) CardFault judge_card_row(uint8_t row, const core::RowLimits& limits) {
  CardRow bytes;
  read_card_row(row, &bytes);
  return core::judge_row(bytes, limits);
}

__attribute__((noinline)) bool learned_axis_good(uint8_t n) {
  const uint16_t at = static_cast<uint16_t>(card_axis_part(n) * frames::kCardPartBytes);
  core::AxisCard axis;
  read_card(at, &axis, sizeof axis);
  return core::axis_good(axis);
}

__attribute__((noinline)) bool learned_worth_good(uint8_t n) {
  const uint16_t at = static_cast<uint16_t>((card_axis_part(n) + 1U) * frames::kCardPartBytes);
  frames::CardWorthLayout worth;
  read_card(at, &worth, sizeof worth);
  return core::worth_good(worth);
}

uint8_t card_u8(uint16_t offset) {
  uint8_t value;
  read_card(offset, &value, sizeof value);
  return value;
}

bool card_row_holds(uint8_t row) {
  const uint16_t part = static_cast<uint16_t>(frames::kCardHeadParts + row);
  return card_u8(static_cast<uint16_t>(part * frames::kCardPartBytes + offsetof(CardRow, axes))) >>
             frames::kCardHeldShift !=
         0;
}

__attribute__((noinline)) bool learning_good(uint8_t rows, uint8_t axes) {
  for (uint8_t row = 0; row < rows; ++row) {
    const uint8_t learned = card_axis_of_row(row);
    if (!core::axis_of_row_good(learned, axes)) return false;
    // One memory for both.
    if (learned != 0 && card_row_holds(row)) return false;
  }
  for (uint8_t n = 1; n <= axes; ++n) {
    if (!learned_axis_good(n) || !learned_worth_good(n)) return false;
  }
  return true;
}

__attribute__((noinline)) bool hold_part_good(uint8_t part) {
  uint16_t amplitude_max_us[core::kCardAxes];
  read_card(offsetof(CardHead, amplitude_max_us), amplitude_max_us, sizeof amplitude_max_us);
  frames::CardHoldLayout hold;
  read_card_part(part, reinterpret_cast<uint8_t*>(&hold));
  return core::hold_good(hold, amplitude_max_us);
}

}  // namespace

void read_card(uint16_t offset, void* to, uint8_t size) {
  hal::read_eeprom_bytes(static_cast<uint16_t>(kCardAddress + offset), to, size);
}

void read_card_part(uint8_t part, uint8_t* to) {
  read_card(static_cast<uint16_t>(part * frames::kCardPartBytes), to, frames::kCardPartBytes);
}

uint16_t card_u16(uint16_t offset) {
  uint16_t value;
  read_card(offset, &value, sizeof value);
  return value;
}

CardFault judge_card(const char* aircraft) {
  core::RowLimits limits;
  const CardFault head = judge_card_head(aircraft, &limits);
  if (head != CardFault::kNone) return head;
  for (uint8_t row = 0; row < card_rows(); ++row) {
    const CardFault fault = judge_card_row(row, limits);
    if (fault != CardFault::kNone) return fault;
  }
  const uint8_t axes = card_u8(offsetof(CardHead, learned_axes));
  if (!learning_good(card_rows(), axes)) return CardFault::kLearning;
  const uint8_t hold = card_hold_part();
  return hold == 0 || hold_part_good(hold) ? CardFault::kNone : CardFault::kHold;
}

bool card_marked_valid() {
  return hal::read_eeprom(kCardValidAddress) == kCardValid;
}

uint32_t card_hash() {
  uint32_t hash;
  read_card(offsetof(CardHead, crc), &hash, sizeof hash);
  return hash;
}

uint8_t card_rows() {
  return card_u8(offsetof(CardHead, rows));
}

uint8_t card_axis_part(uint8_t n) {
  return static_cast<uint8_t>(frames::kCardHeadParts + card_rows() +
                              frames::kCardAxisParts * (n - 1U));
}

uint8_t card_parts() {
  const uint8_t axes = card_u8(offsetof(CardHead, learned_axes));
  return static_cast<uint8_t>(card_axis_part(static_cast<uint8_t>(axes + 1U)) +
                              card_u8(offsetof(CardHead, hold)));
}

uint8_t card_hold_part() {
  if (card_u8(offsetof(CardHead, hold)) == 0) return 0;
  return static_cast<uint8_t>(card_parts() - 1U);
}

uint8_t card_axis_of_row(uint8_t row) {
  return card_u8(static_cast<uint16_t>(2U * frames::kCardPartBytes +
                                       offsetof(frames::CardLearningLayout, axis_of_row) + row));
}

}  // namespace app
