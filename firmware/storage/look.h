// Job: what is on the card. Reads only, so it may run in flight: boot sector, FSInfo, root folder,
// then the newest flight file, where its used part ends and whether its chain is one run. Every
// walk is bounded, whatever the card holds.
#pragma once

#include <stdint.h>

#include "storage/card_state.h"
#include "storage/chain_check.h"
#include "storage/end_search.h"

namespace storage {

class Look {
 public:
  static constexpr uint32_t kMostBlocks = 131072;       // of a file of ours
  static constexpr uint16_t kMostFolderSectors = 4096;  // 65536 entries are a folder's limit

  Wish start(CardState& card);
  Wish next(const uint8_t* sector, CardState& card);
  VolumeStatus status() const { return status_; }  // behind kDone

 private:
  enum class Phase : uint8_t {
    kBoot,
    kPartition,
    kTable,
    kInfo,
    kFolder,
    kFolderChain,
    kEntry,
    kEnd,
    kChain
  };

  Wish try_partition(const uint8_t* sector, const CardState& card);
  Wish mounted(CardState& card);
  Wish walk_folder(CardState& card);
  Wish folder_sector(const uint8_t* sector, CardState& card);
  Wish folder_cluster(const uint8_t* sector, CardState& card);
  Wish folder_ends(CardState& card);
  Wish inspect(const Entry& entry, CardState& card);
  Wish conclude(CardState& card) const;
  Wish found(FileState state, frames::FileState odd, CardState& card) const;

  Phase phase_;
  VolumeStatus status_;
  uint8_t partition_;
  bool read_only_;
  FolderWalk walk_;
  uint32_t lba_;  // of the boot sector or of the folder's sector that is read
  union {
    struct {
      uint32_t cluster;
      uint32_t mark;  // a cluster passed before: met again, the folder's chain is a ring
      uint16_t sectors;
      uint16_t steps;  // until the mark is set anew
      uint16_t stride;
    } folder_;
    EndSearch end_;
    ChainCheck chain_;
  };
};

}  // namespace storage
