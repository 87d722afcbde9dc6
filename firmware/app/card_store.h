// The flight card in the EEPROM: parts of 48 bytes behind one byte that says whether they count.
#pragma once

#include <stdint.h>

#include "core/flight_card.h"
#include "hal/eeprom.h"

namespace app {

// A place in the EEPROM that nothing else uses (store.h: settings, sessions, the reference).
constexpr uint16_t kCardValidAddress = 1024;
constexpr uint16_t kCardAddress = 1040;
constexpr uint8_t kCardValid = 0xC5;  // neither erased nor cleared

inline uint16_t card_part_address(uint8_t part) {
  return static_cast<uint16_t>(kCardAddress + part * frames::kCardPartBytes);
}

// Bytes of the head from `offset` on, or of a row.
void read_card(uint16_t offset, void* to, uint8_t size);
void read_card_part(uint8_t part, uint8_t* to);
uint16_t card_u16(uint16_t offset);
inline void read_card_row(uint8_t row, core::CardRow* to) {
  read_card_part(static_cast<uint8_t>(frames::kCardHeadParts + row),
                 reinterpret_cast<uint8_t*>(to));
}

// All of it, whatever the valid byte says: 8 ms for a card of 32 rows. `aircraft` is the setting.
frames::CardFault judge_card(const char* aircraft);
bool card_marked_valid();
uint32_t card_hash();
uint8_t card_rows();
uint8_t card_parts();  // all of them
// Part card_hold: the last; 0: the card has none.
uint8_t card_hold_part();
// The part of the nth axis that is learned, n from 1; behind it stands what it is worth.
uint8_t card_axis_part(uint8_t n);
// n of a row; 0: nothing is learned while it is flown.
uint8_t card_axis_of_row(uint8_t row);

}  // namespace app
