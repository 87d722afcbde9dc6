// Job: makes a flight file of a run of free clusters, or gives a file that was never recorded into
// more room: the run behind it, or another, larger one. Every power cut leaves the file whole, and
// clusters behind it or clusters that belong to none.
#pragma once

#include <stdint.h>

#include "storage/allocation.h"
#include "storage/card_state.h"
#include "storage/free_run.h"

namespace storage {

class MakeFile {
 public:
  enum class Kind : uint8_t {
    kNew,      // with the next number
    kReplace,  // card.file keeps its number and entry
    kGrow,     // and its place: the run begins behind it
  };
  Wish start(const Run& run, uint32_t blocks, uint32_t session, Kind kind, CardState& card);
  Wish next(uint8_t* sector, CardState& card);
  uint8_t percent() const;

 private:
  enum class Phase : uint8_t {
    kFolderLink,
    kFolderClear,
    kFolderJoin,
    kFolderJoined,
    kLink,
    kOldBlock,
    kBuild,
    kBlock,
    kEntry,
    kEntryWritten,
    kFreeOld
  };

  Wish link(const CardState& card);
  Wish lengthen_folder(uint8_t* sector, CardState& card);
  FlightFile made(const CardState& card) const;
  Wish read_folder(const CardState& card);
  Wish enter(uint8_t* sector, CardState& card);
  Wish entered(CardState& card);

  Allocation allocation_;
  Run run_;
  uint32_t blocks_;
  uint32_t session_;
  union {
    uint32_t file_id_;
    uint32_t lba_;  // of the folder's new cluster or table
  };
  Phase phase_;
  Kind kind_;
};

}  // namespace storage
