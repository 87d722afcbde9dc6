#include "storage/make_file.h"

#include <string.h>

#include "core/block.h"
#include "core/bytes.h"
#include "hal/block_device.h"
#include "storage/block_build.h"
#include "storage/fat_sector.h"

namespace storage {

Wish MakeFile::start(
    const Run& run, uint32_t blocks, uint32_t session, Kind kind, CardState& card) {
  run_ = run;
  blocks_ = blocks;
  session_ = session;
  kind_ = kind;
  if (kind == Kind::kGrow) {
    // Its first block stays, and so does its id.
    file_id_ = card.file.file_id;
    session_ = card.file.last_session;
    run_.first = card.first_cluster();
    phase_ = Phase::kLink;
    const uint32_t last = run_.first + card.layout.clusters_for(blocks) - 1;
    return allocation_.start(Edit::kExtend, run.first - 1, last, card);
  }
  if (kind == Kind::kReplace || card.free_entry.lba != 0) return link(card);
  // The root folder is full: the first cluster becomes its next.
  phase_ = Phase::kFolderLink;
  return allocation_.start(Edit::kLink, run.first, run.first, card);
}

Wish MakeFile::link(const CardState& card) {
  phase_ = Phase::kLink;
  run_.count = card.layout.clusters_for(blocks_);
  return allocation_.start(Edit::kLink, run_.first, run_.first + run_.count - 1, card);
}

// Empty before it is joined to the folder, in the second copy of the table before the first.
Wish MakeFile::lengthen_folder(uint8_t* sector, CardState& card) {
  const Layout& layout = card.layout;
  switch (phase_) {
    case Phase::kFolderLink: {
      const Wish wish = allocation_.next(sector, card);
      if (wish.kind != Wish::Kind::kDone) return wish;
      phase_ = Phase::kFolderClear;
      lba_ = layout.lba_of(run_.first + 1);
      memset(sector, 0, kSectorBytes);
      return write_block(--lba_);
    }
    case Phase::kFolderClear:
      if (lba_ != layout.lba_of(run_.first)) return write_block(--lba_);
      phase_ = Phase::kFolderJoin;
      return read_block(entry_lba(layout, card.folder_end));
    case Phase::kFolderJoin:
      put_entry(sector, layout, entry_index(layout, card.folder_end), run_.first);
      phase_ = Phase::kFolderJoined;
      lba_ = entry_lba(layout, card.folder_end) + (layout.fats - 1) * layout.fat_sectors;
      return write_block(lba_);
    default:
      if (lba_ != entry_lba(layout, card.folder_end)) {
        lba_ -= layout.fat_sectors;
        return write_block(lba_);
      }
      card.folder_end = run_.first;
      card.free_entry = {layout.lba_of(run_.first), 0};
      ++run_.first;
      --run_.count;
      if (blocks_ > run_.count << layout.cluster_shift) {
        blocks_ = run_.count << layout.cluster_shift;
      }
      return link(card);
  }
}

Wish MakeFile::next(uint8_t* sector, CardState& card) {
  const uint32_t first_lba = card.layout.lba_of(run_.first);
  switch (phase_) {
    case Phase::kFolderLink:
    case Phase::kFolderClear:
    case Phase::kFolderJoin:
    case Phase::kFolderJoined:
      return lengthen_folder(sector, card);
    case Phase::kLink: {
      const Wish wish = allocation_.next(sector, card);
      if (wish.kind != Wish::Kind::kDone) return wish;
      if (kind_ == Kind::kGrow) return read_folder(card);
      phase_ = Phase::kOldBlock;
      return read_block(first_lba);
    }
    case Phase::kOldBlock: {
      // A valid block ends in its own CRC, which makes the CRC over all of it a constant: two files
      // that begin on the same block would get the same id. The place of the file stands in for it:
      // it tells apart two files that begin on blocks never used.
      core::put_le<uint32_t>(sector + core::kBlockCrcOffset, first_lba);
      uint8_t card_id[hal::kCardIdBytes];
      if (hal::read_card_id(card_id) != hal::CardStatus::kOk) return failed();
      file_id_ = core::make_file_id(card_id, session_, sector);
      phase_ = Phase::kBuild;  // by itself: either takes a millisecond
      return again();
    }
    case Phase::kBuild:
      build_schema_block(sector, file_id_, session_);
      phase_ = Phase::kBlock;
      return write_block(first_lba);
    case Phase::kBlock:
      return read_folder(card);
    case Phase::kEntry:
      return enter(sector, card);
    case Phase::kEntryWritten:
      return entered(card);
    case Phase::kFreeOld:
      return allocation_.next(sector, card);
  }
  return failed();
}

Wish MakeFile::read_folder(const CardState& card) {
  phase_ = Phase::kEntry;
  return read_block(kind_ == Kind::kNew ? card.free_entry.lba : card.entry.lba);
}

Wish MakeFile::enter(uint8_t* sector, CardState& card) {
  phase_ = Phase::kEntryWritten;
  const uint32_t bytes = blocks_ * kSectorBytes;
  if (kind_ != Kind::kNew) {
    set_cluster(sector, card.entry.index, run_.first);
    set_size(sector, card.entry.index, bytes, card.fat_date());
    return write_block(card.entry.lba);
  }
  const uint32_t number = card.file.number + 1;
  make_entry(sector, card.free_entry.index, number, run_.first, bytes, card.fat_date());
  return write_block(card.free_entry.lba);
}

Wish MakeFile::entered(CardState& card) {
  const uint32_t old_first = card.first_cluster();
  const uint32_t old_count = card.layout.clusters_for(card.file.blocks);
  card.file = made(card);
  card.state = FileState::kBlank;
  card.odd = frames::FileState::kGood;
  if (kind_ == Kind::kGrow) return done();
  if (kind_ == Kind::kReplace) {
    phase_ = Phase::kFreeOld;
    return allocation_.start(Edit::kFree, old_first, old_first + old_count - 1, card);
  }
  card.entry = card.free_entry;
  card.free_entry = {};
  return done();
}

FlightFile MakeFile::made(const CardState& card) const {
  FlightFile file;
  file.first_lba = card.layout.lba_of(run_.first);
  file.blocks = blocks_;
  file.next_block = 1;
  file.file_id = file_id_;
  file.last_session = session_;
  file.number = card.file.number + (kind_ == Kind::kNew ? 1 : 0);
  return file;
}

uint8_t MakeFile::percent() const {
  if (phase_ != Phase::kLink) return 99;
  return static_cast<uint8_t>(100 -
                              (allocation_.chain().left() * 100 / allocation_.chain().count()));
}

}  // namespace storage
