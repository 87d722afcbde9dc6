// What FatFs asks of a disk, answered by hal/block_device.h.
#include "ff.h"

#include "diskio.h"
#include "hal/block_device.h"

namespace {

DRESULT result_of(hal::CardStatus status) {
  if (status == hal::CardStatus::kOk) return RES_OK;
  return status == hal::CardStatus::kAbsent ? RES_NOTRDY : RES_ERROR;
}

}  // namespace

extern "C" {

DSTATUS disk_status(BYTE) {
  return hal::card_blocks() > 0 ? 0 : STA_NOINIT;
}

DSTATUS disk_initialize(BYTE drive) {
  return disk_status(drive);  // Volume::mount() has started the card
}

DRESULT disk_read(BYTE, BYTE* buffer, LBA_t sector, UINT count) {
  for (UINT i = 0; i < count; ++i) {
    const DRESULT result = result_of(hal::read_card(sector + i, buffer + i * FF_MAX_SS));
    if (result != RES_OK) return result;
  }
  return RES_OK;
}

DRESULT disk_write(BYTE, const BYTE* buffer, LBA_t sector, UINT count) {
  for (UINT i = 0; i < count; ++i) {
    const DRESULT result = result_of(hal::write_card(sector + i, buffer + i * FF_MAX_SS));
    if (result != RES_OK) return result;
  }
  return RES_OK;
}

DRESULT disk_ioctl(BYTE, BYTE command, void* buffer) {
  if (command == GET_SECTOR_COUNT) *static_cast<LBA_t*>(buffer) = hal::card_blocks();
  return RES_OK;  // every write has ended when it returns: nothing is left to sync
}

}  // extern "C"
