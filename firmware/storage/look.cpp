#include "storage/look.h"

#include "hal/block_device.h"
#include "storage/fat_sector.h"

namespace storage {

using Odd = frames::FileState;

Wish Look::start(CardState& card) {
  const uint32_t date = card.date;
  card = CardState();
  card.date = date;
  status_ = VolumeStatus::kNoFat;
  phase_ = Phase::kBoot;
  partition_ = 0;
  lba_ = 0;
  return read_block(0);
}

Wish Look::next(const uint8_t* sector, CardState& card) {
  switch (phase_) {
    case Phase::kBoot:
    case Phase::kPartition:
      switch (read_boot(sector, lba_, hal::card_blocks(), card.layout)) {
        case BootVerdict::kOk:
          return mounted(card);
        case BootVerdict::kDamaged:
          status_ = VolumeStatus::kDamaged;
          break;
        case BootVerdict::kForeign:
          break;
      }
      if (phase_ == Phase::kBoot) return try_partition(sector, card);
      phase_ = Phase::kTable;
      return read_block(0);
    case Phase::kTable:
      return try_partition(sector, card);
    case Phase::kInfo: {
      uint32_t free_clusters = 0;
      uint32_t next = 0;
      if (!read_info(sector, free_clusters, next)) {
        card.layout.info_lba = 0;
      } else {
        if (free_clusters <= card.layout.clusters) card.free_clusters = free_clusters;
        if (card.layout.has_cluster(next)) card.next_cluster = next;
      }
      return walk_folder(card);
    }
    case Phase::kFolder:
      return folder_sector(sector, card);
    case Phase::kFolderChain:
      return folder_cluster(sector, card);
    case Phase::kEntry:
      return inspect(read_entry(sector, card.entry.index, card.layout.wide), card);
    case Phase::kEnd: {
      if (!end_.take(sector, card.file)) return read_block(card.file.first_lba + end_.block());
      if (card.file.next_block == 0) return found(FileState::kNone, Odd::kGood, card);
      const uint32_t count = card.layout.clusters_for(card.file.blocks);
      chain_.start(card.first_cluster(), count);
      phase_ = Phase::kChain;
      return read_block(entry_lba(card.layout, chain_.cluster()));
    }
    case Phase::kChain:
      if (!chain_.take(sector, card.layout)) {
        return read_block(entry_lba(card.layout, chain_.cluster()));
      }
      return conclude(card);
  }
  return failed();
}

Wish Look::try_partition(const uint8_t* sector, const CardState&) {
  while (partition_ < kPartitions) {
    lba_ = partition_start(sector, partition_++);
    if (lba_ == 0 || lba_ >= hal::card_blocks()) continue;
    phase_ = Phase::kPartition;
    return read_block(lba_);
  }
  return done();
}

Wish Look::mounted(CardState& card) {
  status_ = VolumeStatus::kReady;
  card.free_clusters = kUnknown;
  if (card.layout.info_lba == 0) return walk_folder(card);
  phase_ = Phase::kInfo;
  return read_block(card.layout.info_lba);
}

Wish Look::walk_folder(CardState& card) {
  const Layout& layout = card.layout;
  walk_ = {};
  folder_ = {layout.wide ? layout.root : 0, layout.root, 0, 0, 1};
  lba_ = layout.wide ? layout.lba_of(layout.root) : layout.root;
  phase_ = Phase::kFolder;
  return read_block(lba_);
}

Wish Look::folder_sector(const uint8_t* sector, CardState& card) {
  const Layout& layout = card.layout;
  if (walk_.take(sector, lba_)) return folder_ends(card);
  if (++folder_.sectors >= kMostFolderSectors) {
    card.odd = Odd::kFolderBroken;
    return folder_ends(card);
  }
  ++lba_;
  if (!layout.wide) {
    return folder_.sectors < layout.root_sectors ? read_block(lba_) : folder_ends(card);
  }
  if ((folder_.sectors & ((1U << layout.cluster_shift) - 1U)) != 0) return read_block(lba_);
  phase_ = Phase::kFolderChain;
  return read_block(entry_lba(layout, folder_.cluster));
}

// A ring is seen by a mark that is set anew after 1, 2, 4 ... clusters (Brent).
Wish Look::folder_cluster(const uint8_t* sector, CardState& card) {
  const Layout& layout = card.layout;
  const uint32_t next = entry(sector, layout, entry_index(layout, folder_.cluster));
  if (next >= kLeastEndEntry) return folder_ends(card);
  if (!layout.has_cluster(next) || next == folder_.mark) {
    card.odd = Odd::kFolderBroken;
    return folder_ends(card);
  }
  if (++folder_.steps == folder_.stride) {
    folder_.mark = next;
    folder_.steps = 0;
    folder_.stride = static_cast<uint16_t>(folder_.stride * 2);
  }
  folder_.cluster = next;
  lba_ = layout.lba_of(next);
  phase_ = Phase::kFolder;
  return read_block(lba_);
}

Wish Look::folder_ends(CardState& card) {
  card.free_entry = walk_.free;
  card.folder_end = folder_.cluster;
  if (walk_.number == 0) return found(FileState::kNone, card.odd, card);
  card.file.number = walk_.number;
  card.entry = walk_.newest;
  phase_ = Phase::kEntry;
  return read_block(card.entry.lba);
}

Wish Look::inspect(const Entry& entry, CardState& card) {
  const Layout& layout = card.layout;
  if ((entry.attributes & (Entry::kFolder | Entry::kVolume)) != 0) {
    return found(FileState::kClosed, Odd::kNotAFile, card);
  }
  read_only_ = (entry.attributes & Entry::kReadOnly) != 0;
  const uint32_t blocks = entry.bytes / kSectorBytes;
  if (blocks < 2) return found(FileState::kNone, card.odd, card);
  if (blocks > kMostBlocks || !layout.has_cluster(entry.cluster) ||
      !layout.has_cluster(entry.cluster + layout.clusters_for(blocks) - 1)) {
    return found(FileState::kClosed, Odd::kOutOfRange, card);
  }
  card.file.first_lba = layout.lba_of(entry.cluster);
  card.file.blocks = blocks;
  end_.start(blocks);
  phase_ = Phase::kEnd;
  return read_block(card.file.first_lba);
}

Wish Look::conclude(CardState& card) const {
  FlightFile& file = card.file;
  const Odd chain = chain_.state();
  const bool one_run = chain == Odd::kGood || chain == Odd::kChainLong;
  const bool used_up = file.next_block == file.blocks;
  if (read_only_ && !(used_up && one_run)) {
    return found(FileState::kClosed, Odd::kReadOnly, card);
  }
  if (!one_run) {
    const uint32_t in_chain = chain_.length() << card.layout.cluster_shift;
    if (file.next_block > in_chain) file.next_block = in_chain;
    return found(FileState::kClosed, chain, card);
  }
  if (used_up) {
    const bool long_chain = chain == Odd::kChainLong && !read_only_;
    return found(FileState::kClosed, long_chain ? chain : card.odd, card);
  }
  return found(file.next_block == 1 ? FileState::kBlank : FileState::kOpen, card.odd, card);
}

Wish Look::found(FileState state, Odd odd, CardState& card) const {
  card.state = state;
  card.odd = odd;
  return done();
}

}  // namespace storage
