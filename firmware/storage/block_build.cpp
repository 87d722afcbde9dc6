#include "storage/block_build.h"

#include <string.h>

#include "core/bytes.h"
#include "core/crc.h"
#include "core/progmem.h"
#include "generated/frames.h"
#include "generated/schema_blob.h"

namespace storage {

namespace {

void seal(uint8_t* block, core::BlockHeader header) {
  header.schema_hash = frames::kSchemaHash;
  core::put_block_header(block, header);
  core::Crc32 crc;
  crc.add(block, core::kBlockCrcOffset);
  core::put_le<uint32_t>(block + core::kBlockCrcOffset, crc.value());
}

}  // namespace

const char* schema_text() {
  return frames::kSchemaText;
}

uint16_t schema_size() {
  return frames::kSchemaSize;
}

uint32_t schema_hash() {
  return frames::kSchemaHash;
}

void build_schema_block(uint8_t* block, uint32_t file_id, uint32_t session) {
  static_assert(frames::kSchemaSize > core::kBlockPayloadSize, "the schema fills its first block");
  uint8_t* const payload = block + core::kBlockHeaderSize;
  core::put_le<uint16_t>(payload, 0);
  core::put_le<uint16_t>(payload + 2, frames::kSchemaSize);
  core::flash_copy(payload + 4, frames::kSchemaText, core::kBlockPayloadSize - 4);
  core::BlockHeader header = {};
  header.file_id = file_id;
  header.session = session;
  header.used = core::kBlockPayloadSize;
  header.kind = core::BlockKind::kSchema;
  seal(block, header);
}

void build_end_block(uint8_t* block,
                     const core::BlockHeader& header,
                     const frames::FileFrame& made) {
  memset(block, 0, core::kBlockSize);
  frames::EventFrame event = {};
  event.t_us = made.t_us;
  event.code = static_cast<uint8_t>(frames::Event::kSessionEnd);
  event.arg = static_cast<uint32_t>(frames::EndCause::kNextBoot);
  uint8_t* const payload = block + core::kBlockHeaderSize;
  payload[0] = frames::FileFrame::id();
  memcpy(payload + 1, &made, sizeof made);
  uint8_t* const behind = payload + frames::FileFrame::wire_size();
  behind[0] = frames::EventFrame::id();
  memcpy(behind + 1, &event, sizeof event);
  core::BlockHeader full = header;
  full.used = frames::FileFrame::wire_size() + frames::EventFrame::wire_size();
  full.kind = core::BlockKind::kFrames;
  seal(block, full);
}

}  // namespace storage
