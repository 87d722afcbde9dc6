#include "storage/allocation.h"

namespace storage {

Wish Allocation::start(Edit edit, uint32_t first, uint32_t last, const CardState& card) {
  chain_.start(edit, first, last);
  if (card.layout.info_lba == 0 || card.free_clusters == kUnknown) return this->edit(card);
  phase_ = Phase::kForget;
  return read_block(card.layout.info_lba);
}

Wish Allocation::edit(const CardState& card) {
  phase_ = Phase::kRead;
  return read_block(chain_.lba(card.layout));
}

Wish Allocation::next(uint8_t* sector, CardState& card) {
  const Layout& layout = card.layout;
  switch (phase_) {
    case Phase::kForget:
      put_info(sector, kUnknown, card.next_cluster);
      phase_ = Phase::kForgotten;
      return write_block(layout.info_lba);
    case Phase::kForgotten:
      return edit(card);
    case Phase::kRead:
      if (!chain_.edit(sector, layout)) return failed();
      phase_ = Phase::kWritten;
      return write_block(chain_.to_lba(layout));
    case Phase::kWritten:
      switch (chain_.written(layout)) {
        case ChainEdit::Next::kCopy:
          return write_block(chain_.to_lba(layout));
        case ChainEdit::Next::kSector:
          return edit(card);
        case ChainEdit::Next::kDone:
          break;
      }
      if (layout.info_lba == 0) return done();
      phase_ = Phase::kCount;
      return read_block(layout.info_lba);
    case Phase::kCount:
      count(sector, card);
      phase_ = Phase::kCounted;
      return write_block(layout.info_lba);
    case Phase::kCounted:
      return done();
  }
  return failed();
}

void Allocation::count(uint8_t* sector, CardState& card) const {
  const uint32_t changed = chain_.changed();
  uint32_t& free_clusters = card.free_clusters;
  if (free_clusters != kUnknown) {
    const bool taken = chain_.links();
    const uint32_t most = taken ? free_clusters : card.layout.clusters - free_clusters;
    // A count that contradicts what was found free is none.
    free_clusters = changed > most ? kUnknown
                    : taken        ? free_clusters - changed
                                   : free_clusters + changed;
  }
  card.next_cluster = chain_.next_free();
  put_info(sector, free_clusters, card.next_cluster);
}

}  // namespace storage
