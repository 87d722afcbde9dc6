// Session and boot numbers in EEPROM, each write in the next of 16 slots: 100 000 writes a cell
// become 1.6 million boots or sessions. A torn write costs that slot, not the numbers before it.
#pragma once

#include <stdint.h>

namespace core {

struct SessionRecord {
  uint32_t session = 0;  // largest given out
  uint32_t boots = 0;
};

constexpr uint8_t kSessionSlots = 16;
constexpr uint8_t kSessionSlotSize = 14;  // writes u32, session u32, boots u32, CRC-16

// A count above this was never reached: ten times what the cells bear. Believed, the largest number
// would let no later write count.
constexpr uint32_t kMostWrites = 1UL << 24;

class SessionStore {
 public:
  // Once for each slot of the EEPROM, in any order.
  void slot(uint8_t index, const uint8_t* bytes);

  const SessionRecord& latest() const { return latest_; }
  bool found() const { return found_; }
  // Fills the bytes and returns the slot they belong into.
  uint8_t next(const SessionRecord& record, uint8_t* bytes);

 private:
  SessionRecord latest_;
  uint32_t writes_ = 0;
  uint8_t index_ = kSessionSlots - 1;
  bool found_ = false;
};

}  // namespace core
