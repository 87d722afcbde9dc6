// The two blocks that are built as a whole, on the ground: the first and the last of a file.
#pragma once

#include <stdint.h>

#include "core/block.h"
#include "generated/frames.h"

namespace storage {

// The schema text of this firmware, in program memory.
const char* schema_text();
uint16_t schema_size();
uint32_t schema_hash();

// Block 0: the first piece of the schema.
void build_schema_block(uint8_t* block, uint32_t file_id, uint32_t session);

// A block with the frame `file` and the event session_end (next_boot) alone; of `header`, file_id,
// session, sequence and dropped are used.
void build_end_block(uint8_t* block,
                     const core::BlockHeader& header,
                     const frames::FileFrame& made);

}  // namespace storage
