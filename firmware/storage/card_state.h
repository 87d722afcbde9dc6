// What is known of the card, and what a job wants next of it. A job is a sequence of blocks read
// and written; it goes on by one each time it is asked, and never waits.
#pragma once

#include <stdint.h>

#include "generated/frames.h"
#include "storage/boot_sector.h"
#include "storage/end_search.h"
#include "storage/folder.h"

namespace storage {

enum class VolumeStatus : uint8_t {
  kReady,
  kNoCard,
  kNoFat,       // exFAT, FAT12, not formatted
  kUnreadable,  // the card answers with errors
  kFull,
  kFragmented,  // room enough, but not in one piece
  kDamaged,     // a boot sector with numbers that cannot be, a root folder without room
};

enum class FileState : uint8_t {
  kNone,    // no flight file, or the latest is not one of this logger
  kClosed,  // cut to its used length, used to its end, or not to be touched
  kBlank,   // prepared, never recorded into
  kOpen,    // holds a recording that nobody ended
};

struct CardState {
  Layout layout = {};
  FlightFile file;             // the newest
  EntryPlace entry = {};       // its own
  EntryPlace free_entry = {};  // for the next
  uint32_t folder_end = 0;     // last cluster of the root folder; FAT16: 0
  uint32_t free_clusters = 0;  // as FSInfo says, or kUnknown
  uint32_t next_cluster = 0;   // where FSInfo would look for a free one
  uint32_t date = 0;           // of new and closed files; 0: not known
  FileState state = FileState::kNone;
  frames::FileState odd = frames::FileState::kGood;  // what is wrong with the newest file

  uint32_t fat_date() const {
    constexpr uint32_t kLogger = (46UL << 25) | (1UL << 21) | (1UL << 16);  // 2026-01-01
    return date == 0 ? kLogger : date;
  }
  uint32_t first_cluster() const { return layout.cluster_of(file.first_lba); }
};

struct Wish {
  enum class Kind : uint8_t {
    kRead,   // block `lba` into the sector
    kWrite,  // the sector to block `lba`
    kAgain,  // nothing: ask again
    kDone,
    kFailed,
  };
  Kind kind;
  uint32_t lba;
};

inline Wish read_block(uint32_t lba) {
  return {Wish::Kind::kRead, lba};
}
inline Wish write_block(uint32_t lba) {
  return {Wish::Kind::kWrite, lba};
}
inline Wish again() {
  return {Wish::Kind::kAgain, 0};
}
inline Wish done() {
  return {Wish::Kind::kDone, 0};
}
inline Wish failed() {
  return {Wish::Kind::kFailed, 0};
}

}  // namespace storage
