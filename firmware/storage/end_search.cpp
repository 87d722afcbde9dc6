#include "storage/end_search.h"

#include <stddef.h>

#include "core/block.h"
#include "core/bytes.h"
#include "generated/frames.h"

namespace storage {

namespace {

// A block the card refused twice leaves a hole; so many blocks behind the end are looked at.
constexpr uint8_t kLookAhead = 64;

bool note(const uint8_t* block, uint32_t number, FlightFile& file) {
  core::BlockHeader header;
  const bool own = core::check_block(block, header) == core::BlockVerdict::kOk &&
                   (number == 0 || header.file_id == file.file_id) && header.sequence == number;
  if (!own || number + 2 < file.next_block) return own;
  const bool frames = header.kind == core::BlockKind::kFrames;
  const uint8_t* const made =
      frames ? core::find_frame(block, header.used, frames::kFileId) : nullptr;
  if (made != nullptr) {
    file.made_bytes = core::get_le<uint32_t>(made + 1 + offsetof(frames::FileFrame, preallocated));
  }
  if (number < file.next_block) return own;
  file.file_id = header.file_id;
  file.next_block = number + 1;
  file.last_session = header.session;
  file.last_dropped = header.dropped;
  const uint8_t end = static_cast<uint8_t>(frames::Event::kSessionEnd);
  file.ended = frames && core::block_has_event(block, header.used, end);
  return true;
}

}  // namespace

bool EndSearch::take(const uint8_t* block, FlightFile& file) {
  const bool own = note(block, block_, file);
  if (file.next_block == 0 || room_asked_) return true;
  if (ahead_ != 0) return look_ahead(file, own);
  if (!own) behind_ = block_;
  if (behind_ > file.next_block) {
    block_ = file.next_block + (behind_ - file.next_block) / 2;
    return false;
  }
  ahead_ = 1;
  block_ = file.next_block + 1;
  return block_ >= file.blocks && ask_room(file);
}

bool EndSearch::look_ahead(const FlightFile& file, bool own) {
  if (own) {  // beyond a hole: the search begins anew behind it
    ahead_ = 0;
    behind_ = file.blocks;
    block_ = file.next_block + (behind_ - file.next_block) / 2;
    return file.next_block >= behind_ && ask_room(file);
  }
  ++block_;
  return (++ahead_ > kLookAhead || block_ >= file.blocks) && ask_room(file);
}

// The frame that names the room may stand in the block before the last.
bool EndSearch::ask_room(const FlightFile& file) {
  if (file.made_bytes != 0 || file.next_block < 2) return true;
  room_asked_ = true;
  block_ = file.next_block - 2;
  return false;
}

}  // namespace storage
