// Decides what the next block of the log is and hands out its bytes. No block is stored: the
// header is made when it goes out, frames come from the ring, the schema from program memory.
// The ring is emptied only when the card has accepted the block, so that it can be sent again.
#pragma once

#include <stdint.h>

#include "core/block.h"
#include "core/byte_ring.h"
#include "core/crc.h"

namespace core {

class BlockWriter {
 public:
  static constexpr uint32_t kSchemaReturnUs = 60000000UL;

  // `schema` lies in program memory.
  constexpr BlockWriter(ByteRing& ring, const char* schema, uint16_t schema_size, uint32_t hash)
      : ring_(ring), schema_(schema), schema_size_(schema_size), schema_hash_(hash) {}

  // `first_sequence`: 0 in a new file, else the number behind the last block of the file.
  // Clears the ring; `take_identities_due` is true at once, before any other frame is pushed.
  void start(uint32_t file_id, uint32_t session, uint32_t first_sequence, uint32_t now_us);
  // What is in the ring goes out, the last block partly filled; then `drained` is true.
  void finish() { finishing_ = true; }
  bool drained() const { return finishing_ && !due_ && ring_.used() == 0; }

  // Call while the card is idle. True: a block is due; hand it out with `stream`.
  __attribute__((always_inline)) bool due(uint32_t now_us) {
    if (due_) return true;
    // In most turns nothing is.
    if (ring_.used() < kBlockPayloadSize && !schema_pass() && !finishing_ &&
        now_us - schema_us_ < kSchemaReturnUs) {
      return false;
    }
    return decide(now_us);
  }

  // Hands out at most `limit` bytes to `sink.put(const uint8_t*, uint16_t, Crc32&)`, which adds
  // them to the CRC; the first call the whole header. True when all 512 are out; then call one of
  // the three below.
  template <typename Sink>
  bool stream(Sink& sink, uint16_t limit) {
    uint8_t stage[kStage];
    while (position_ < kBlockSize && limit != 0) {
      uint16_t size = 0;
      const uint8_t* piece = next_piece(stage, limit, size);
      sink.put(piece, size, crc_);
      limit = size < limit ? static_cast<uint16_t>(limit - size) : 0;
    }
    return position_ >= kBlockSize;
  }
  void accepted();
  void rejected() { position_ = 0; }  // the same content again, at the same place
  void skip();                        // the same content again, one place further

  // True once when config, identity and coefficients are to be pushed: at the start and behind
  // every return of the schema.
  bool take_identities_due();

  uint32_t sequence() const { return sequence_; }  // of the block due now or next
  uint32_t session() const { return session_; }
  uint32_t blocks_written() const { return blocks_written_; }  // since start()
  bool schema_pass() const { return schema_offset_ < schema_size_; }

 private:
  static constexpr uint8_t kStage = 32;
  static constexpr uint16_t kSchemaPiece = kBlockPayloadSize - 4;

  bool decide(uint32_t now_us);
  const uint8_t* next_piece(uint8_t* stage, uint16_t limit, uint16_t& size);
  const uint8_t* payload_piece(uint8_t* stage, uint16_t limit, uint16_t& size) const;

  ByteRing& ring_;
  const char* const schema_;
  const uint16_t schema_size_;
  const uint32_t schema_hash_;
  uint32_t file_id_ = 0;
  uint32_t session_ = 0;
  uint32_t sequence_ = 0;
  uint32_t blocks_written_ = 0;
  uint32_t schema_us_ = 0;  // start of the last pass
  Crc32 crc_;
  uint16_t schema_offset_ = 0xFFFF;  // next piece; at or behind schema_size_: no pass is on
  uint16_t position_ = 0;            // bytes of the due block already out
  uint16_t used_ = 0;
  BlockKind kind_ = BlockKind::kFrames;
  bool due_ = false;
  bool finishing_ = true;
  bool identities_due_ = false;
  bool head_ = false;  // the schema's first pass of this session
};

}  // namespace core
