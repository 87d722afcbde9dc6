// Writes a run of clusters into the allocation table: as a chain, or free again. From the back to
// the front, sector by sector, into each copy: what a power cut leaves is a chain that is too long
// (freeing) or clusters that belong to no file (linking), never a chain cut short.
#pragma once

#include <stdint.h>

#include "storage/boot_sector.h"

namespace storage {

enum class Edit : uint8_t {
  kLink,    // one chain of all; they must be free
  kExtend,  // the same, behind the first, which is the end of a chain
  kFree,    // all of them
  kTrim,    // all but the first, which becomes the end of its chain
};

class ChainEdit {
 public:
  void start(Edit edit, uint32_t first, uint32_t last) {
    edit_ = edit;
    first_ = first;
    last_ = last;
    at_ = last;
    copies_done_ = 0;
  }
  // Block of the first copy that is to be read, then changed by `edit`, then written to `to_lba`.
  uint32_t lba(const Layout& layout) const;
  // False: an entry that should be free is not.
  bool edit(uint8_t* sector, const Layout& layout) const;
  // The first copy, which is read, comes last: until then the change is as if never begun.
  uint32_t to_lba(const Layout& layout) const {
    const uint8_t copy = static_cast<uint8_t>(layout.fats - 1 - copies_done_);
    return lba(layout) + copy * layout.fat_sectors;
  }
  // The sector is written. kCopy: again, to the next copy; kSector: read the next; kDone: all is.
  enum class Next : uint8_t { kCopy, kSector, kDone };
  Next written(const Layout& layout);

  // The first cluster behind what is in use now.
  uint32_t next_free() const {
    return links() ? last_ + 1 : edit_ == Edit::kTrim ? first_ + 1 : first_;
  }
  uint32_t count() const { return last_ - first_ + 1; }
  // Clusters that become used or free.
  uint32_t changed() const {
    return edit_ == Edit::kExtend || edit_ == Edit::kTrim ? last_ - first_ : count();
  }
  bool links() const { return edit_ == Edit::kLink || edit_ == Edit::kExtend; }
  uint32_t left() const { return at_ - first_ + 1; }

 private:
  uint32_t first_in_sector(const Layout& layout) const;

  uint32_t first_;
  uint32_t last_;
  uint32_t at_;  // the last that is not yet written
  uint8_t copies_done_;
  Edit edit_;
};

}  // namespace storage
