// The card's file system: finds, prepares and closes flight files FLTnnnnn.BIN. The only room that
// sees FatFs. Every call here may wait for the card (hal/block_device.h); none is made in flight,
// except mount() and find_latest(), which write nothing.
#pragma once

#include <stdint.h>

#include "ff.h"
#include "hal/block_device.h"

namespace storage {

enum class VolumeStatus : uint8_t {
  kReady,
  kNoCard,
  kNoFat,       // exFAT, not formatted
  kUnreadable,  // the card answers with errors
  kFull,
  kFragmented,  // room enough, but not in one piece
};

enum class FileState : uint8_t {
  kNone,    // no flight file, or the latest is not one of this logger
  kClosed,  // cut to its used length, or used to its end
  kBlank,   // prepared, never recorded into
  kOpen,    // holds a recording that nobody ended
};

struct FlightFile {
  uint32_t first_lba = 0;
  uint32_t blocks = 0;  // room
  uint32_t next_block = 0;
  uint32_t file_id = 0;
  uint32_t last_session = 0;  // of its last block; 0: none
  uint32_t last_dropped = 0;
  uint32_t number = 0;
  bool ended = false;  // its last block says session_end
};

class Volume {
 public:
  static constexpr uint32_t kFileBlocks = 131072;  // 64 MiB: 2.6 h at 100 Hz
  static constexpr uint32_t kMaxNumber = 99999;

  // What FatFs needs between mount() and unmount(); anybody's else.
  using Memory = FATFS;
  explicit Volume(Memory& memory) : fs_(memory) {}

  // Tests use smaller files. At least 2 blocks.
  void set_file_blocks(uint32_t blocks) { file_blocks_ = blocks; }
  // Date of new and closed files, as core::fat_time() makes it; 0: not known.
  static void set_date(uint32_t fat_time);

  VolumeStatus mount();
  // The same for a card that is known and was not changed since; file() stays.
  VolumeStatus mount_again();
  // FatFs forgets the volume and its memory.
  static void unmount();
  // Looks at the file with the largest number: what it holds, and where its used part ends.
  VolumeStatus find_latest(FileState* state);
  // Makes the file with the next number: contiguous, with a first block of its own, so that its
  // id is known and no older block behind it can be taken for its content.
  VolumeStatus prepare(uint32_t session);
  // Cuts file() to `used_blocks`. With `end_event` a block saying session_end 2 goes behind them.
  VolumeStatus close(uint32_t used_blocks, bool end_event, uint32_t now_us);

  const FlightFile& file() const { return file_; }
  bool smaller_than_new() const { return file_.blocks < file_blocks_; }

 private:
  using Name = char[13];  // 8.3 and a zero

  static void make_name(uint32_t number, Name name);
  static uint32_t number_of(const char* name);
  VolumeStatus from_result(FRESULT result) const;
  VolumeStatus find_largest(uint32_t* number);
  VolumeStatus shortage() const;
  VolumeStatus inspect(FIL* fil, FileState* state);
  VolumeStatus find_end();
  hal::CardStatus own_block(uint32_t block, bool* own);
  VolumeStatus write_first_block(uint32_t session);
  hal::CardStatus write_end_event(uint32_t block, uint32_t now_us);
  uint8_t* window();

  FATFS& fs_;
  FlightFile file_;
  uint32_t file_blocks_ = kFileBlocks;
};

}  // namespace storage
