// Finds where the used part of a flight file ends: a binary search for the last block that carries
// the file's id and its own number, then some blocks further. About 80 blocks are read.
#pragma once

#include <stdint.h>

namespace storage {

struct FlightFile {
  uint32_t first_lba = 0;
  uint32_t blocks = 0;      // room
  uint32_t next_block = 0;  // 0: the first block is none of ours
  uint32_t file_id = 0;
  uint32_t last_session = 0;  // of its last block; 0: none
  uint32_t last_dropped = 0;
  uint32_t number = 0;
  uint32_t made_bytes = 0;  // preallocated, as its last two blocks say; 0: they do not
  bool ended = false;       // its last block says session_end
};

class EndSearch {
 public:
  void start(uint32_t blocks) {
    block_ = 0;
    behind_ = blocks;
    ahead_ = 0;
    room_asked_ = false;
  }
  uint32_t block() const { return block_; }  // of the file: it is looked at next
  // Notes in `file` what the block says if it is its own. True: the end is found.
  bool take(const uint8_t* block, FlightFile& file);

 private:
  bool look_ahead(const FlightFile& file, bool own);
  bool ask_room(const FlightFile& file);

  uint32_t block_;
  uint32_t behind_;  // first block known not to be the file's own
  bool room_asked_;
  uint8_t ahead_;  // 0: the binary search is on; else how far behind the end is looked
};

}  // namespace storage
