// The 512-byte block of the log: header, payload, CRC-32. Layout in protocol/README.md.
#pragma once

#include <stdint.h>

namespace core {

constexpr uint16_t kBlockSize = 512;
constexpr uint16_t kBlockHeaderSize = 28;
constexpr uint16_t kBlockPayloadSize = 480;
constexpr uint16_t kBlockCrcOffset = 508;

enum class BlockKind : uint8_t { kFrames = 0, kSchema = 1 };

struct BlockHeader {
  uint32_t file_id;
  uint32_t session;
  uint32_t sequence;
  uint32_t schema_hash;
  uint32_t dropped;
  uint16_t used;
  BlockKind kind;
};

enum class BlockVerdict : uint8_t { kOk, kMagic, kCrc, kUsed, kKind };

// Writes the 28 bytes before the payload.
void put_block_header(uint8_t* to, const BlockHeader& header);

// The first check that fails, in the order of the enum. `header` is filled only for kOk.
BlockVerdict check_block(const uint8_t* block, BlockHeader& header);

// The next whole frame of a frame block: returns its size with the id, 0 at the end or at an id
// that the schema does not have. `offset` counts from the start of the payload.
uint8_t frame_at(const uint8_t* block, uint16_t used, uint16_t offset);

// The first frame with that id in a frame block, its id byte; null: there is none.
const uint8_t* find_frame(const uint8_t* block, uint16_t used, uint8_t id);

// True when a frame block holds the event `code`.
bool block_has_event(const uint8_t* block, uint16_t used, uint8_t code);

// Id of a new file: over CID, session and what its first block held (protocol/README.md, File).
uint32_t make_file_id(const uint8_t* cid, uint32_t session, const uint8_t* old_first_block);

}  // namespace core
