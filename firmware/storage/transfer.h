// One block on its way between the card and memory. No call waits.
#pragma once

#include <stdint.h>

#include "hal/block_device.h"

namespace storage {

class Transfer {
 public:
  void read(uint32_t lba) { begin(lba, Way::kRead); }
  void write(uint32_t lba) { begin(lba, Way::kWrite); }
  bool writes() const { return way_ == Way::kWrite; }
  bool under_way() const { return begun_; }
  // kBusy: ask again. A write is not begun while `may_write` is false.
  hal::CardStatus step(uint8_t* sector, bool may_write);

 private:
  enum class Way : uint8_t { kRead, kWrite };

  void begin(uint32_t lba, Way way) {
    lba_ = lba;
    way_ = way;
    begun_ = false;
  }

  uint32_t lba_ = 0;
  Way way_ = Way::kRead;
  bool begun_ = false;
};

}  // namespace storage
