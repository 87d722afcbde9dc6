// Blocks as the card gets them, read back with the block check.
#include <string.h>

#include "check.h"
#include "core/block.h"
#include "core/block_writer.h"
#include "core/bytes.h"
#include "core/progmem.h"
#include "generated/frames.h"

namespace {

constexpr uint16_t kRing = 2000;
constexpr uint16_t kSchemaSize = 1000;  // three pieces
constexpr uint32_t kHash = 0x12345678U;
constexpr uint32_t kMinuteUs = core::BlockWriter::kSchemaReturnUs;

struct Text {
  char letters[kSchemaSize];
};
constexpr Text make_text() {
  Text text = {};
  for (uint16_t i = 0; i < kSchemaSize; ++i) {
    text.letters[i] = static_cast<char>('A' + i % 61 % 26);
  }
  return text;
}
constexpr Text kSchema CORE_FLASH = make_text();

uint8_t buffer[kRing];
uint8_t block[core::kBlockSize];

struct Card {
  void put(const uint8_t* data, uint16_t size, core::Crc32& crc) {
    crc.add(data, size);
    if (at + size <= core::kBlockSize) {
      memcpy(block + at, data, size);
    }
    at = static_cast<uint16_t>(at + size);
  }
  uint16_t at = 0;
};

struct Log {
  core::ByteRing ring{buffer, kRing};
  core::BlockWriter writer{ring, kSchema.letters, kSchemaSize, kHash};

  // Hands the due block out in steps and checks it.
  core::BlockHeader send(uint16_t step) {
    Card card;
    uint16_t turns = 0;
    while (!writer.stream(card, step)) {
      ++turns;
    }
    core::BlockHeader header = {};
    CHECK_EQ(card.at, core::kBlockSize);
    CHECK_EQ(static_cast<uint8_t>(core::check_block(block, header)), 0);
    return header;
  }
  void push(uint16_t count) {
    frames::MagFrame frame = {};
    while (count-- != 0) {
      frame.t_us = number++;
      ring.push(frame);
    }
  }
  // Past the schema of the session's head.
  void start(uint32_t first_sequence) {
    writer.start(0xF11E, 9, first_sequence, 0);
    writer.take_identities_due();
    while (writer.due(0)) {
      send(512);
      writer.accepted();
    }
  }
  uint32_t number = 0;
};

bool payload_zero_behind(uint16_t used) {
  for (uint16_t i = static_cast<uint16_t>(core::kBlockHeaderSize + used); i < core::kBlockCrcOffset;
       ++i) {
    if (block[i] != 0) {
      return false;
    }
  }
  return true;
}

}  // namespace

TEST_CASE("a session begins with identities asked for and the whole schema") {
  Log log;
  log.writer.start(0xF11E, 9, 4, 0);
  CHECK(log.writer.take_identities_due());
  CHECK(!log.writer.take_identities_due());
  log.push(50);
  uint16_t offset = 0;
  for (uint32_t i = 0; i < 3; ++i) {
    REQUIRE(log.writer.due(0));
    const core::BlockHeader header = log.send(64);
    CHECK_EQ(static_cast<uint8_t>(header.kind), static_cast<uint8_t>(core::BlockKind::kSchema));
    CHECK(header.sequence == 4 + i);
    CHECK(header.session == 9U);
    CHECK(header.file_id == 0xF11EU);
    CHECK(header.schema_hash == kHash);
    const uint8_t* payload = block + core::kBlockHeaderSize;
    CHECK_EQ(core::get_le<uint16_t>(payload), offset);
    CHECK_EQ(core::get_le<uint16_t>(payload + 2), kSchemaSize);
    uint8_t wrong = 0;
    for (uint16_t k = 0; k < header.used - 4; ++k) {
      wrong = static_cast<uint8_t>(
          wrong + (payload[4 + k] != core::flash_u8(kSchema.letters + offset + k)));
    }
    CHECK_EQ(wrong, 0);
    CHECK(payload_zero_behind(header.used));
    offset = static_cast<uint16_t>(offset + header.used - 4);
    log.writer.accepted();
  }
  CHECK_EQ(offset, kSchemaSize);
  CHECK(!log.writer.take_identities_due());
  REQUIRE(log.writer.due(0));
  CHECK_EQ(static_cast<uint8_t>(log.send(512).kind), 0);
}

TEST_CASE("a slow card at the head: frames go first when they fill half of the ring") {
  Log log;
  log.writer.start(1, 1, 0, 0);
  log.push(kRing / 2 / frames::kMagWireSize + 1);
  REQUIRE(log.writer.due(0));
  CHECK_EQ(static_cast<uint8_t>(log.send(512).kind), 0);
  log.writer.accepted();
  REQUIRE(log.writer.due(0));
  CHECK_EQ(static_cast<uint8_t>(log.send(512).kind), 1);
}

TEST_CASE("a block goes out when no further frame fits, never before") {
  Log log;
  log.start(0);
  log.push(43);  // 473 bytes: a frame of 7 might still fit
  CHECK(!log.writer.due(1));
  log.push(1);
  REQUIRE(log.writer.due(1));
  const core::BlockHeader header = log.send(100);
  CHECK_EQ(header.used, 473);
  CHECK(payload_zero_behind(473));
  CHECK_EQ(core::frame_at(block, header.used, 0), frames::kMagWireSize);
  CHECK_EQ(log.ring.used(), 44 * 11);  // kept until the card has accepted
  log.writer.accepted();
  CHECK_EQ(log.ring.used(), 11);
  CHECK(log.writer.blocks_written() == 4U);
}

TEST_CASE("after a reject the same block again, though frames arrived meanwhile") {
  Log log;
  log.start(0);
  log.push(44);
  REQUIRE(log.writer.due(1));
  log.send(64);
  uint8_t first[core::kBlockSize];
  memcpy(first, block, sizeof(first));
  log.writer.rejected();
  log.push(20);
  REQUIRE(log.writer.due(2));
  log.send(512);
  CHECK(memcmp(first, block, sizeof(first)) == 0);
}

TEST_CASE("a skipped place loses no frame, only a sequence number") {
  Log log;
  log.start(0);
  log.push(44);
  REQUIRE(log.writer.due(1));
  const core::BlockHeader refused = log.send(512);
  log.writer.rejected();
  log.writer.skip();
  REQUIRE(log.writer.due(2));
  const core::BlockHeader moved = log.send(512);
  CHECK(moved.sequence == refused.sequence + 1);
  CHECK_EQ(core::get_le<uint32_t>(block + core::kBlockHeaderSize + 1), 0);  // the first frame
}

TEST_CASE("the schema returns after a minute, only while no whole block waits") {
  Log log;
  log.start(0);
  log.push(44);
  REQUIRE(log.writer.due(kMinuteUs));
  CHECK_EQ(static_cast<uint8_t>(log.send(512).kind), 0);
  log.writer.accepted();
  for (uint8_t i = 0; i < 3; ++i) {
    CHECK(!log.writer.take_identities_due());
    REQUIRE(log.writer.due(kMinuteUs + 1));
    CHECK_EQ(static_cast<uint8_t>(log.send(512).kind), 1);
    log.writer.accepted();
  }
  CHECK(log.writer.take_identities_due());
  CHECK(!log.writer.due(kMinuteUs + 2));
  CHECK(log.writer.due(2 * kMinuteUs));
}

TEST_CASE("the dropped count stands in the block built after the loss") {
  Log log;
  log.start(0);
  log.push(300);
  const uint32_t dropped = log.ring.dropped();
  REQUIRE(dropped > 100);
  REQUIRE(log.writer.due(1));
  CHECK(log.send(512).dropped == dropped);
}

TEST_CASE("the end: what waits goes out in a block partly filled") {
  Log log;
  log.start(0);
  log.push(10);
  CHECK(!log.writer.due(1));
  CHECK(!log.writer.drained());
  log.writer.finish();
  REQUIRE(log.writer.due(2));
  CHECK_EQ(log.send(512).used, 110);
  CHECK(!log.writer.drained());
  log.writer.accepted();
  CHECK(log.writer.drained());
  CHECK(!log.writer.due(kMinuteUs * 2));
}

TEST_CASE("a last block that is rejected keeps its content, though an event came behind it") {
  Log log;
  log.start(0);
  log.push(10);
  log.writer.finish();
  REQUIRE(log.writer.due(1));
  log.send(512);
  log.writer.rejected();
  log.push(1);
  REQUIRE(log.writer.due(2));
  CHECK_EQ(log.send(512).used, 110);
  log.writer.accepted();
  REQUIRE(log.writer.due(3));
  CHECK_EQ(log.send(512).used, 11);
}

TEST_CASE("the end does not wait for a schema that was just returning") {
  Log log;
  log.start(0);
  log.push(10);
  REQUIRE(log.writer.due(kMinuteUs));
  log.send(512);
  log.writer.accepted();
  REQUIRE(log.writer.schema_pass());
  log.writer.finish();
  REQUIRE(log.writer.due(kMinuteUs + 1));
  CHECK_EQ(static_cast<uint8_t>(log.send(512).kind), 0);
  log.writer.accepted();
  CHECK(log.writer.drained());
  CHECK(!log.writer.due(kMinuteUs + 2));
}

TEST_CASE("before any session nothing is due") {
  Log log;
  CHECK(!log.writer.due(kMinuteUs * 2));
  CHECK(log.writer.drained());
}
