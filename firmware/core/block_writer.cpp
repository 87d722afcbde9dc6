#include "core/block_writer.h"

#include "core/bytes.h"
#include "core/progmem.h"

namespace core {

void BlockWriter::start(uint32_t file_id,
                        uint32_t session,
                        uint32_t first_sequence,
                        uint32_t now_us) {
  ring_.clear();
  file_id_ = file_id;
  session_ = session;
  sequence_ = first_sequence;
  blocks_written_ = 0;
  schema_us_ = now_us;
  schema_offset_ = 0;
  due_ = false;
  finishing_ = false;
  head_ = true;
  identities_due_ = true;
}

bool BlockWriter::decide(uint32_t now_us) {
  if (!schema_pass() && !finishing_ && now_us - schema_us_ >= kSchemaReturnUs) {
    schema_us_ = now_us;
    schema_offset_ = 0;
  }
  // The head of a session comes before its frames unless these fill half of the ring; later a
  // piece of schema goes out only while the ring is nearly empty: the card may stall behind it.
  const uint16_t give_way =
      static_cast<uint16_t>((head_ ? ring_.capacity() : kBlockPayloadSize) / 2);
  const bool schema_goes_on = schema_pass() && (head_ || !finishing_);
  if (schema_goes_on && ring_.used() < give_way) {
    const uint16_t left = static_cast<uint16_t>(schema_size_ - schema_offset_);
    kind_ = BlockKind::kSchema;
    used_ = static_cast<uint16_t>(4 + (left < kSchemaPiece ? left : kSchemaPiece));
  } else if (ring_.used() >= kBlockPayloadSize || (finishing_ && ring_.used() != 0)) {
    kind_ = BlockKind::kFrames;
    used_ = ring_.whole(kBlockPayloadSize);
  } else {
    return false;
  }
  due_ = true;
  position_ = 0;
  return true;
}

const uint8_t* BlockWriter::next_piece(uint8_t* stage, uint16_t limit, uint16_t& size) {
  const uint8_t* piece = stage;
  if (position_ == 0) {
    const BlockHeader header = {
        file_id_, session_, sequence_, schema_hash_, ring_.dropped(), used_, kind_};
    put_block_header(stage, header);
    size = kBlockHeaderSize;
    crc_ = Crc32();
  } else if (position_ < kBlockCrcOffset) {
    piece = payload_piece(stage, limit, size);
  } else {
    put_le(stage, crc_.value());
    size = 4;
  }
  position_ = static_cast<uint16_t>(position_ + size);
  return piece;
}

const uint8_t* BlockWriter::payload_piece(uint8_t* stage, uint16_t limit, uint16_t& size) const {
  const uint16_t offset = static_cast<uint16_t>(position_ - kBlockHeaderSize);
  const bool filled = offset < used_;
  uint16_t left = static_cast<uint16_t>((filled ? used_ : kBlockPayloadSize) - offset);
  if (left > limit) {
    left = limit;
  }
  if (filled && kind_ == BlockKind::kFrames) {
    return ring_.run(offset, left, size);
  }
  size = left < kStage ? left : kStage;
  if (!filled) {
    memset(stage, 0, size);
  } else if (offset < 4) {
    uint8_t head[4];
    put_le(head, schema_offset_);
    put_le(head + 2, schema_size_);
    size = static_cast<uint16_t>(size < 4 - offset ? size : 4 - offset);
    memcpy(stage, head + offset, size);
  } else {
    flash_copy(stage, schema_ + schema_offset_ + offset - 4, size);
  }
  return stage;
}

void BlockWriter::accepted() {
  due_ = false;
  ++sequence_;
  ++blocks_written_;
  if (kind_ == BlockKind::kFrames) {
    ring_.consume(used_);
    return;
  }
  schema_offset_ = static_cast<uint16_t>(schema_offset_ + used_ - 4);
  if (!schema_pass()) {
    identities_due_ = !head_;
    head_ = false;
  }
}

void BlockWriter::skip() {
  position_ = 0;
  ++sequence_;
}

bool BlockWriter::take_identities_due() {
  const bool due = identities_due_;
  identities_due_ = false;
  return due;
}

}  // namespace core
