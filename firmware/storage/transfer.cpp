#include "storage/transfer.h"

namespace storage {

using hal::CardStatus;

CardStatus Transfer::step(uint8_t* sector, bool may_write) {
  if (!begun_) {
    if (lba_ >= hal::card_blocks()) {
      return hal::card_blocks() == 0 ? CardStatus::kAbsent : CardStatus::kError;
    }
    if (!writes()) {
      hal::begin_read(lba_);
    } else if (may_write) {
      hal::begin_write(lba_);
    } else {
      return CardStatus::kBusy;
    }
    begun_ = true;
  }
  const CardStatus status = writes() ? hal::poll_write(sector) : hal::poll_read(sector);
  if (status != CardStatus::kBusy) begun_ = false;
  return status;
}

}  // namespace storage
