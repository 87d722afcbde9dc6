// A change of the allocation table with FSInfo's counts around it: they are unknown while the table
// is written, so that no power cut leaves a count that is wrong.
#pragma once

#include <stdint.h>

#include "storage/card_state.h"
#include "storage/chain_edit.h"

namespace storage {

class Allocation {
 public:
  // The clusters `first` to `last`.
  Wish start(Edit edit, uint32_t first, uint32_t last, const CardState& card);
  // kFailed: a cluster to be linked is not free.
  Wish next(uint8_t* sector, CardState& card);
  const ChainEdit& chain() const { return chain_; }

 private:
  enum class Phase : uint8_t { kForget, kForgotten, kRead, kWritten, kCount, kCounted };

  Wish edit(const CardState& card);
  void count(uint8_t* sector, CardState& card) const;

  ChainEdit chain_;
  Phase phase_;
};

}  // namespace storage
