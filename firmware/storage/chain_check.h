// Is the chain of a file one run of consecutive clusters, as long as its size? Sector by sector;
// each is read once, so that no chain, cyclic or not, takes longer than a good one.
#pragma once

#include <stdint.h>

#include "generated/frames.h"
#include "storage/boot_sector.h"

namespace storage {

class ChainCheck {
 public:
  // All clusters of the run are the volume's.
  void start(uint32_t first, uint32_t count) {
    first_ = first;
    at_ = first;
    last_ = first + count - 1;
    state_ = frames::FileState::kGood;
  }
  uint32_t cluster() const { return at_; }  // the sector that holds its entry is looked at next
  // True: the answer is known.
  bool take(const uint8_t* sector, const Layout& layout);

  // Good, chain_short, chain_long, chain_broken, cyclic or not_in_one_piece.
  frames::FileState state() const { return state_; }
  uint32_t length() const { return at_ - first_ + 1; }  // clusters in one run, at most the count

 private:
  frames::FileState judge(uint32_t next, const Layout& layout) const;

  uint32_t first_;
  uint32_t at_;
  uint32_t last_;
  frames::FileState state_;
};

}  // namespace storage
