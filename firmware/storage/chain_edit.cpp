#include "storage/chain_edit.h"

#include "storage/fat_sector.h"

namespace storage {

uint32_t ChainEdit::lba(const Layout& layout) const {
  return entry_lba(layout, at_);
}

uint32_t ChainEdit::first_in_sector(const Layout& layout) const {
  const uint32_t first = at_ - entry_index(layout, at_);
  return first < first_ ? first_ : first;
}

bool ChainEdit::edit(uint8_t* sector, const Layout& layout) const {
  uint32_t cluster = first_in_sector(layout);
  uint16_t index = entry_index(layout, cluster);
  for (; cluster <= at_; ++cluster, ++index) {
    uint32_t value = kFreeEntry;
    if (links()) {
      const bool ours = edit_ == Edit::kExtend && cluster == first_;
      if (!ours && entry(sector, layout, index) != kFreeEntry) return false;
      value = cluster == last_ ? kEndEntry : cluster + 1;
    } else if (edit_ == Edit::kTrim && cluster == first_) {
      value = kEndEntry;
    }
    put_entry(sector, layout, index, value);
  }
  return true;
}

ChainEdit::Next ChainEdit::written(const Layout& layout) {
  if (++copies_done_ < layout.fats) return Next::kCopy;
  copies_done_ = 0;
  const uint32_t first = first_in_sector(layout);
  if (first == first_) return Next::kDone;
  at_ = first - 1;
  return Next::kSector;
}

}  // namespace storage
