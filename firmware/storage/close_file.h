// Job: cuts a flight file to what it holds. Its size first, then the chain behind it is freed, so
// that a power cut leaves a chain that is too long; the next boot mends that with the same job.
#pragma once

#include <stdint.h>

#include "storage/allocation.h"
#include "storage/card_state.h"

namespace storage {

class CloseFile {
 public:
  // Cuts card.file to `used_blocks`. With `end_event` a block saying session_end goes behind
  // them.
  Wish start(uint32_t used_blocks, bool end_event, uint32_t now_us, CardState& card);
  // Puts right what card.odd says of a closed file: chain_long, chain_short.
  Wish mend(CardState& card);
  static bool can_mend(const CardState& card);

  Wish next(uint8_t* sector, CardState& card);

 private:
  enum class Phase : uint8_t { kBuild, kEndBlock, kEntry, kEntryWritten, kTail, kTrim };

  Wish entry(const CardState& card);
  Wish trim(CardState& card);
  Wish follow_tail(const uint8_t* sector, CardState& card);

  Allocation allocation_;
  uint32_t used_blocks_;
  uint32_t last_;  // cluster of the chain that is to be freed, as far as it was followed
  uint32_t now_us_;
  Phase phase_;
  bool whole_chain_;  // the chain is as long as the size was
};

}  // namespace storage
