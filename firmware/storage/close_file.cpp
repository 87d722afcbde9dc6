#include "storage/close_file.h"

#include "storage/block_build.h"
#include "storage/fat_sector.h"

namespace storage {

using Odd = frames::FileState;

Wish CloseFile::start(uint32_t used_blocks, bool end_event, uint32_t now_us, CardState& card) {
  used_blocks_ = used_blocks;
  now_us_ = now_us;
  whole_chain_ = true;
  last_ = card.first_cluster() + card.layout.clusters_for(card.file.blocks) - 1;
  if (!end_event || used_blocks >= card.file.blocks) return entry(card);
  phase_ = Phase::kBuild;
  return again();
}

bool CloseFile::can_mend(const CardState& card) {
  const FlightFile& file = card.file;
  if (card.state != FileState::kClosed) return false;
  if (card.odd == Odd::kChainShort) return file.next_block != 0 && file.next_block < file.blocks;
  return card.odd == Odd::kChainLong && file.made_bytes != 0;
}

Wish CloseFile::mend(CardState& card) {
  whole_chain_ = false;
  used_blocks_ = card.file.next_block;
  if (card.odd == Odd::kChainShort) return entry(card);
  last_ = card.first_cluster() + card.layout.clusters_for(used_blocks_) - 1;
  phase_ = Phase::kTail;
  return read_block(entry_lba(card.layout, last_));
}

Wish CloseFile::entry(const CardState& card) {
  phase_ = Phase::kEntry;
  return read_block(card.entry.lba);
}

Wish CloseFile::next(uint8_t* sector, CardState& card) {
  switch (phase_) {
    case Phase::kBuild: {
      core::BlockHeader header = {};
      header.file_id = card.file.file_id;
      header.session = card.file.last_session;
      header.sequence = used_blocks_;
      header.dropped = card.file.last_dropped;
      build_end_block(sector, header, {now_us_, card.file.number, card.file.blocks * kSectorBytes});
      phase_ = Phase::kEndBlock;
      return write_block(card.file.first_lba + used_blocks_++);
    }
    case Phase::kEndBlock:
      return entry(card);
    case Phase::kEntry:
      set_size(sector, card.entry.index, used_blocks_ * kSectorBytes, card.fat_date());
      phase_ = Phase::kEntryWritten;
      return write_block(card.entry.lba);
    case Phase::kEntryWritten:
      card.file.blocks = used_blocks_;
      card.file.next_block = used_blocks_;
      card.state = FileState::kClosed;
      card.odd = Odd::kGood;
      return whole_chain_ ? trim(card) : done();
    case Phase::kTail:
      return follow_tail(sector, card);
    case Phase::kTrim:
      return allocation_.next(sector, card);
  }
  return failed();
}

Wish CloseFile::trim(CardState& card) {
  const uint32_t end = card.first_cluster() + card.layout.clusters_for(used_blocks_) - 1;
  if (last_ <= end) return done();
  phase_ = Phase::kTrim;
  return allocation_.start(Edit::kTrim, end, last_, card);
}

// What is freed must be this file's: the chain goes on consecutively to no more than the room that
// the file's own last block names, and ends there or where freeing was cut off.
Wish CloseFile::follow_tail(const uint8_t* sector, CardState& card) {
  const Layout& layout = card.layout;
  const uint32_t room = layout.clusters_for(card.file.made_bytes / kSectorBytes);
  const uint32_t end = card.first_cluster() + room - 1;
  uint16_t index = entry_index(layout, last_);
  for (; index >> entries_shift(layout) == 0; ++index) {
    const uint32_t next = storage::entry(sector, layout, index);
    if (next == last_ + 1 && last_ < end && layout.has_cluster(next)) {
      ++last_;
      continue;
    }
    if (next == kFreeEntry) --last_;
    const bool ours = next == kFreeEntry || (next >= kLeastEndEntry && last_ == end);
    card.odd = Odd::kGood;
    return ours ? trim(card) : done();
  }
  return read_block(entry_lba(layout, last_));
}

}  // namespace storage
