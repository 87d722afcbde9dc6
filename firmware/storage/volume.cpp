#include "storage/volume.h"

#include <string.h>

#include "core/block.h"
#include "core/bytes.h"
#include "core/progmem.h"
#include "generated/frames.h"
#include "storage/block_build.h"

namespace storage {

using hal::CardStatus;

namespace {

uint32_t g_date = 0;

// Of a flight's file; a digit stands for each 0.
constexpr char kNamePattern[] CORE_FLASH = "FLT00000.BIN";

constexpr uint32_t kNoSector = 0xFFFFFFFFUL;

// A block the card refused twice leaves a hole; so many blocks behind the end are looked at.
constexpr uint8_t kLookAhead = 64;

VolumeStatus from_card(CardStatus status) {
  switch (status) {
    case CardStatus::kOk:
      return VolumeStatus::kReady;
    case CardStatus::kAbsent:
      return VolumeStatus::kNoCard;
    case CardStatus::kBusy:
    case CardStatus::kRejected:
    case CardStatus::kError:
      break;
  }
  return VolumeStatus::kUnreadable;
}

}  // namespace

extern "C" DWORD get_fattime() {
  // FatFs wants a date; 2026-01-01 is the one of a logger that does not know it.
  constexpr DWORD kUnknown = (46UL << 25) | (1UL << 21) | (1UL << 16);
  return g_date == 0 ? kUnknown : g_date;
}

void Volume::set_date(uint32_t fat_time) {
  g_date = fat_time;
}

VolumeStatus Volume::mount() {
  file_ = FlightFile();
  const CardStatus status = hal::start_card();
  if (status != CardStatus::kOk) return from_card(status);
  return mount_again();
}

VolumeStatus Volume::mount_again() {
  return from_result(f_mount(&fs_, "", 1));
}

void Volume::unmount() {
  (void)f_mount(nullptr, "", 0);
}

VolumeStatus Volume::from_result(FRESULT result) const {
  if (result == FR_OK) return VolumeStatus::kReady;
  if (result == FR_NOT_READY || hal::card_blocks() == 0) return VolumeStatus::kNoCard;
  return result == FR_NO_FILESYSTEM ? VolumeStatus::kNoFat : VolumeStatus::kUnreadable;
}

void Volume::make_name(uint32_t number, Name name) {
  core::flash_copy(name, kNamePattern, sizeof(Name));
  for (uint8_t place = 7; number > 0; --place) {
    name[place] = static_cast<char>('0' + number % 10);
    number /= 10;
  }
}

uint32_t Volume::number_of(const char* name) {
  uint32_t number = 0;
  for (uint8_t place = 0; place < sizeof(Name); ++place) {
    const char wanted = static_cast<char>(core::flash_u8(kNamePattern + place));
    if (wanted != '0') {
      if (name[place] != wanted) return 0;
      continue;
    }
    if (name[place] < '0' || name[place] > '9') return 0;
    number = number * 10 + static_cast<uint32_t>(name[place] - '0');
  }
  return number;
}

VolumeStatus Volume::find_largest(uint32_t* number) {
  *number = 0;
  DIR dir;
  FRESULT result = f_opendir(&dir, "");
  while (result == FR_OK) {
    FILINFO info;
    result = f_readdir(&dir, &info);
    if (result != FR_OK || info.fname[0] == '\0') break;
    const uint32_t found = number_of(info.fname);
    if (found > *number) *number = found;
  }
  return from_result(result);
}

VolumeStatus Volume::find_latest(FileState* state) {
  *state = FileState::kNone;
  file_ = FlightFile();
  uint32_t number = 0;
  const VolumeStatus status = find_largest(&number);
  if (status != VolumeStatus::kReady || number == 0) return status;
  file_.number = number;
  Name name;
  make_name(number, name);
  FIL fil;
  const FRESULT result = f_open(&fil, name, FA_READ);
  if (result != FR_OK) return from_result(result);
  return inspect(&fil, state);
}

VolumeStatus Volume::inspect(FIL* fil, FileState* state) {
  const uint32_t blocks = static_cast<uint32_t>(f_size(fil) / hal::kCardBlockBytes);
  if (blocks < 2) return VolumeStatus::kReady;
  const uint32_t first_cluster = fil->obj.sclust;
  const FRESULT result = f_lseek(fil, f_size(fil));
  if (result != FR_OK) return from_result(result);
  const uint32_t clusters = (blocks + fs_.csize - 1) / fs_.csize;
  const bool one_piece = fil->clust == first_cluster + clusters - 1;
  file_.first_lba = fs_.database + (first_cluster - 2) * fs_.csize;
  file_.blocks = blocks;
  const VolumeStatus status = find_end();
  if (status != VolumeStatus::kReady) return status;
  if (file_.next_block == 0) return VolumeStatus::kReady;
  if (file_.next_block == file_.blocks || !one_piece) {
    *state = FileState::kClosed;
  } else {
    *state = file_.next_block == 1 ? FileState::kBlank : FileState::kOpen;
  }
  return VolumeStatus::kReady;
}

uint8_t* Volume::window() {
  // FatFs's sector buffer serves as ours between its calls: it is clean then, and is read anew.
  fs_.winsect = kNoSector;
  return fs_.win;
}

CardStatus Volume::own_block(uint32_t block, bool* own) {
  const CardStatus status = hal::read_card(file_.first_lba + block, window());
  core::BlockHeader header;
  *own = status == CardStatus::kOk &&
         core::check_block(fs_.win, header) == core::BlockVerdict::kOk &&
         (block == 0 || header.file_id == file_.file_id) && header.sequence == block;
  if (*own && block >= file_.next_block) {
    file_.file_id = header.file_id;
    file_.next_block = block + 1;
    file_.last_session = header.session;
    file_.last_dropped = header.dropped;
    file_.ended = header.kind == core::BlockKind::kFrames &&
                  core::block_has_event(
                      fs_.win, header.used, static_cast<uint8_t>(frames::Event::kSessionEnd));
  }
  return status;
}

VolumeStatus Volume::find_end() {
  bool own = false;
  CardStatus status = own_block(0, &own);
  if (!own) return from_card(status);
  uint32_t behind = file_.blocks;  // the first block known not to be ours
  for (;;) {
    while (behind - file_.next_block > 0) {
      const uint32_t middle = file_.next_block + (behind - file_.next_block) / 2;
      status = own_block(middle, &own);
      if (status != CardStatus::kOk) return from_card(status);
      if (!own) behind = middle;
    }
    const uint32_t end = file_.next_block;
    for (uint32_t ahead = end + 1; ahead <= end + kLookAhead && ahead < file_.blocks; ++ahead) {
      status = own_block(ahead, &own);
      if (status != CardStatus::kOk) return from_card(status);
      if (own) break;
    }
    if (file_.next_block == end) return VolumeStatus::kReady;
    behind = file_.blocks;
  }
}

VolumeStatus Volume::prepare(uint32_t session) {
  uint32_t number = 0;
  VolumeStatus status = find_largest(&number);
  if (status != VolumeStatus::kReady) return status;
  if (number >= kMaxNumber) return VolumeStatus::kFull;
  file_ = FlightFile();
  file_.number = number + 1;
  Name name;
  make_name(file_.number, name);
  FIL fil;
  FRESULT result = f_open(&fil, name, FA_WRITE | FA_CREATE_NEW);
  if (result == FR_DENIED) return VolumeStatus::kFull;
  if (result != FR_OK) return from_result(result);
  result = f_expand(&fil, static_cast<FSIZE_t>(file_blocks_) * hal::kCardBlockBytes, 1);
  if (result == FR_DENIED) {
    (void)f_close(&fil);
    (void)f_unlink(name);
    return shortage();
  }
  if (result != FR_OK) return from_result(result);
  file_.first_lba = fs_.database + (fil.obj.sclust - 2) * fs_.csize;
  file_.blocks = file_blocks_;
  // All of the allocation must be on the card before its window is borrowed, the directory's
  // entry last: a cut before it leaves an empty file and lost clusters, never a wrong content.
  if (fs_.wflag != 0) {
    if (hal::write_card(fs_.winsect, fs_.win) != CardStatus::kOk) return VolumeStatus::kUnreadable;
    if (fs_.n_fats == 2 && fs_.winsect - fs_.fatbase < fs_.fsize &&
        hal::write_card(fs_.winsect + fs_.fsize, fs_.win) != CardStatus::kOk) {
      return VolumeStatus::kUnreadable;
    }
    fs_.wflag = 0;
  }
  status = write_first_block(session);
  if (status != VolumeStatus::kReady) return status;
  return from_result(f_close(&fil));
}

VolumeStatus Volume::shortage() const {
  DWORD free_clusters = 0;
  FATFS* fs = nullptr;
  const FRESULT result = f_getfree("", &free_clusters, &fs);
  if (result != FR_OK) return from_result(result);
  const uint32_t needed = (file_blocks_ + fs->csize - 1) / fs->csize;
  return free_clusters >= needed ? VolumeStatus::kFragmented : VolumeStatus::kFull;
}

VolumeStatus Volume::write_first_block(uint32_t session) {
  uint8_t* const block = window();
  CardStatus status = hal::read_card(file_.first_lba, block);
  if (status != CardStatus::kOk) return from_card(status);
  // A valid block ends in its own CRC, which makes the CRC over all of it a constant: two files
  // that begin on the same block would get the same id. The place of the file stands in for it:
  // it tells apart two files that begin on blocks never used.
  core::put_le<uint32_t>(block + core::kBlockCrcOffset, file_.first_lba);
  uint8_t card_id[hal::kCardIdBytes];
  status = hal::read_card_id(card_id);
  if (status != CardStatus::kOk) return from_card(status);
  file_.file_id = core::make_file_id(card_id, session, block);
  build_schema_block(block, file_.file_id, session);
  status = hal::write_card(file_.first_lba, block);
  file_.next_block = 1;
  file_.last_session = session;
  return from_card(status);
}

CardStatus Volume::write_end_event(uint32_t block, uint32_t now_us) {
  core::BlockHeader header = {};
  header.file_id = file_.file_id;
  header.session = file_.last_session;
  header.sequence = block;
  header.dropped = file_.last_dropped;
  build_end_block(window(), header, now_us);
  return hal::write_card(file_.first_lba + block, fs_.win);
}

VolumeStatus Volume::close(uint32_t used_blocks, bool end_event, uint32_t now_us) {
  if (end_event && used_blocks < file_.blocks) {
    const CardStatus status = write_end_event(used_blocks, now_us);
    if (status != CardStatus::kOk) return from_card(status);
    ++used_blocks;
  }
  window();
  Name name;
  make_name(file_.number, name);
  FIL fil;
  FRESULT result = f_open(&fil, name, FA_WRITE | FA_OPEN_EXISTING);
  if (result == FR_OK) {
    result = f_lseek(&fil, static_cast<FSIZE_t>(used_blocks) * hal::kCardBlockBytes);
    if (result == FR_OK) result = f_truncate(&fil);
    const FRESULT closed = f_close(&fil);
    if (result == FR_OK) result = closed;
  }
  file_.blocks = used_blocks;
  file_.next_block = used_blocks;
  return from_result(result);
}

}  // namespace storage
