#include "core/block.h"

#include "core/bytes.h"
#include "core/crc.h"
#include "generated/frames.h"

namespace core {
namespace {

constexpr uint32_t kMagic = 0x31544C46UL;  // "FLT1"

}  // namespace

void put_block_header(uint8_t* to, const BlockHeader& header) {
  put_le(to, kMagic);
  put_le(to + 4, header.file_id);
  put_le(to + 8, header.session);
  put_le(to + 12, header.sequence);
  put_le(to + 16, header.schema_hash);
  put_le(to + 20, header.dropped);
  put_le(to + 24, header.used);
  to[26] = static_cast<uint8_t>(header.kind);
  to[27] = 0;
}

BlockVerdict check_block(const uint8_t* block, BlockHeader& header) {
  if (get_le<uint32_t>(block) != kMagic) {
    return BlockVerdict::kMagic;
  }
  Crc32 crc;
  crc.add(block, kBlockCrcOffset);
  if (crc.value() != get_le<uint32_t>(block + kBlockCrcOffset)) {
    return BlockVerdict::kCrc;
  }
  const uint16_t used = get_le<uint16_t>(block + 24);
  if (used > kBlockPayloadSize) {
    return BlockVerdict::kUsed;
  }
  if (block[26] > static_cast<uint8_t>(BlockKind::kSchema)) {
    return BlockVerdict::kKind;
  }
  header.file_id = get_le<uint32_t>(block + 4);
  header.session = get_le<uint32_t>(block + 8);
  header.sequence = get_le<uint32_t>(block + 12);
  header.schema_hash = get_le<uint32_t>(block + 16);
  header.dropped = get_le<uint32_t>(block + 20);
  header.used = used;
  header.kind = static_cast<BlockKind>(block[26]);
  return BlockVerdict::kOk;
}

uint8_t frame_at(const uint8_t* block, uint16_t used, uint16_t offset) {
  if (offset >= used) {
    return 0;
  }
  const uint8_t size = frames::wire_size(block[kBlockHeaderSize + offset]);
  return size <= used - offset ? size : 0;
}

const uint8_t* find_frame(const uint8_t* block, uint16_t used, uint8_t id) {
  uint16_t offset = 0;
  for (uint8_t size = frame_at(block, used, 0); size != 0; size = frame_at(block, used, offset)) {
    const uint8_t* frame = block + kBlockHeaderSize + offset;
    if (frame[0] == id) {
      return frame;
    }
    offset = static_cast<uint16_t>(offset + size);
  }
  return nullptr;
}

bool block_has_event(const uint8_t* block, uint16_t used, uint8_t code) {
  uint16_t offset = 0;
  for (uint8_t size = frame_at(block, used, 0); size != 0; size = frame_at(block, used, offset)) {
    const uint8_t* frame = block + kBlockHeaderSize + offset;
    if (frame[0] == frames::kEventId && frame[1 + offsetof(frames::EventFrame, code)] == code) {
      return true;
    }
    offset = static_cast<uint16_t>(offset + size);
  }
  return false;
}

uint32_t make_file_id(const uint8_t* cid, uint32_t session, const uint8_t* old_first_block) {
  uint8_t bytes[4];
  put_le(bytes, session);
  Crc32 crc;
  crc.add(cid, 16);
  crc.add(bytes, 4);
  crc.add(old_first_block, kBlockSize);
  return crc.value();
}

}  // namespace core
