#include "storage/chain_check.h"

#include "storage/fat_sector.h"

namespace storage {

using frames::FileState;

bool ChainCheck::take(const uint8_t* sector, const Layout& layout) {
  uint16_t index = entry_index(layout, at_);
  const uint16_t behind = static_cast<uint16_t>(1U << entries_shift(layout));
  for (; index < behind; ++index) {
    const uint32_t next = entry(sector, layout, index);
    if (at_ == last_ || next != at_ + 1) {
      state_ = judge(next, layout);
      return true;
    }
    ++at_;
  }
  return false;
}

FileState ChainCheck::judge(uint32_t next, const Layout& layout) const {
  if (next >= kLeastEndEntry) return at_ == last_ ? FileState::kGood : FileState::kChainShort;
  if (!layout.has_cluster(next)) return FileState::kChainBroken;
  if (next >= first_ && next <= at_) return FileState::kCyclic;
  return at_ == last_ && next == at_ + 1 ? FileState::kChainLong : FileState::kNotInOnePiece;
}

}  // namespace storage
