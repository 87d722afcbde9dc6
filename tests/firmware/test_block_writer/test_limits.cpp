// What the next block is, to the byte of the ring and the microsecond of the schema's return.
#include <string.h>

#include "check.h"
#include "core/block.h"
#include "core/block_writer.h"
#include "core/bytes.h"
#include "core/progmem.h"
#include "generated/frames.h"

namespace {

using core::BlockKind;

constexpr uint16_t kRing = 2000;
constexpr uint16_t kPiece = core::kBlockPayloadSize - 4;
constexpr uint16_t kSchemaSize = 2 * kPiece;  // just two blocks
constexpr uint32_t kMinuteUs = core::BlockWriter::kSchemaReturnUs;

struct Text {
  char letters[kSchemaSize];
};
constexpr Text make_text() {
  Text text = {};
  for (uint16_t i = 0; i < kSchemaSize; ++i) {
    text.letters[i] = static_cast<char>(' ' + i % 89);
  }
  return text;
}
constexpr Text kSchema CORE_FLASH = make_text();

uint8_t buffer[kRing];
uint8_t block[core::kBlockSize];

struct Card {
  uint16_t at = 0;
  uint16_t most = 0;  // bytes put at once; header and CRC always go whole

  void put(const uint8_t* data, uint16_t size, core::Crc32& crc) {
    crc.add(data, size);
    most = at != 0 && at != core::kBlockCrcOffset && size > most ? size : most;
    if (at + size <= core::kBlockSize) {
      memcpy(block + at, data, size);
    }
    at = static_cast<uint16_t>(at + size);
  }
};

struct Session {
  core::ByteRing ring{buffer, kRing};
  core::BlockWriter writer{ring, kSchema.letters, kSchemaSize, 77};

  void push(uint8_t baros, uint8_t mags) {  // 20 and 11 bytes each
    frames::BaroFrame baro = {};
    frames::MagFrame mag = {};
    for (; baros != 0; --baros) {
      ring.push(baro);
    }
    for (; mags != 0; --mags) {
      ring.push(mag);
    }
  }
  // The due block, or one of kind 9 if none is.
  core::BlockHeader take(uint32_t now_us, uint16_t step = 512) {
    core::BlockHeader header = {};
    header.kind = static_cast<BlockKind>(9);
    if (!writer.due(now_us)) {
      return header;
    }
    Card card;
    while (!writer.stream(card, step)) {
    }
    CHECK_EQ(card.at, core::kBlockSize);
    CHECK(card.most <= step);
    CHECK(core::check_block(block, header) == core::BlockVerdict::kOk);
    writer.accepted();
    return header;
  }
  bool next_is(BlockKind kind, uint32_t now_us) { return take(now_us).kind == kind; }
  void start(uint32_t now_us) {
    writer.start(5, 6, 0, now_us);
    writer.take_identities_due();
    CHECK(next_is(BlockKind::kSchema, now_us));
    CHECK(next_is(BlockKind::kSchema, now_us));
  }
};

}  // namespace

TEST_CASE("at the head half a ring of frames goes first, a byte less does not") {
  Session full;
  full.writer.start(5, 6, 0, 0);
  full.push(50, 0);
  REQUIRE(full.ring.used() == kRing / 2);
  CHECK(full.next_is(BlockKind::kFrames, 0));
  CHECK(full.next_is(BlockKind::kSchema, 0));
  Session less;
  less.writer.start(5, 6, 0, 0);
  less.push(45, 9);
  REQUIRE(less.ring.used() == kRing / 2 - 1);
  CHECK(less.next_is(BlockKind::kSchema, 0));
}

TEST_CASE("later half a block of frames keeps the schema back, a byte less does not") {
  Session half;
  half.start(0);
  half.push(12, 0);
  REQUIRE(half.ring.used() == core::kBlockPayloadSize / 2);
  CHECK(!half.writer.due(kMinuteUs));
  Session less;
  less.start(0);
  less.push(7, 9);
  REQUIRE(less.ring.used() == core::kBlockPayloadSize / 2 - 1);
  CHECK(less.next_is(BlockKind::kSchema, kMinuteUs));
}

TEST_CASE("480 bytes of frames are a block, 479 are not yet") {
  Session session;
  session.start(0);
  session.push(19, 9);
  REQUIRE(session.ring.used() == core::kBlockPayloadSize - 1);
  CHECK(!session.writer.due(1));
  session.writer.finish();
  CHECK_EQ(session.take(1).used, core::kBlockPayloadSize - 1);
  CHECK_EQ(block[core::kBlockCrcOffset - 1], 0);
  Session full;
  full.start(0);
  full.push(24, 0);
  const core::BlockHeader header = full.take(1, 31);
  CHECK_EQ(header.used, core::kBlockPayloadSize);
  CHECK_EQ(full.ring.used(), 0);
}

TEST_CASE("a schema of just two blocks is two, each full, in any portions, and no third") {
  const uint16_t steps[] = {1, 3, 31, 32, 33, 512};
  for (const uint16_t step : steps) {
    Session session;
    session.writer.start(5, 6, 0, 0);
    for (uint16_t offset = 0; offset < kSchemaSize;
         offset = static_cast<uint16_t>(offset + kPiece)) {
      CHECK(session.writer.schema_pass());
      const core::BlockHeader header = session.take(0, step);
      CHECK(header.kind == BlockKind::kSchema);
      CHECK_EQ(header.used, core::kBlockPayloadSize);
      const uint8_t* payload = block + core::kBlockHeaderSize;
      CHECK_EQ(core::get_le<uint16_t>(payload), offset);
      CHECK_EQ(core::get_le<uint16_t>(payload + 2), kSchemaSize);
      uint16_t wrong = 0;
      for (uint16_t i = 0; i < kPiece; ++i) {
        wrong = static_cast<uint16_t>(
            wrong + (payload[4 + i] != core::flash_u8(kSchema.letters + offset + i)));
      }
      CHECK_EQ(wrong, 0);
    }
    CHECK(!session.writer.schema_pass());
    CHECK(!session.writer.due(0));
  }
}

TEST_CASE("the schema returns a minute after it began, to the microsecond, again and again") {
  Session session;
  uint32_t now_us = 0xFFFFFFFFU - 1000;
  session.start(now_us);
  for (uint8_t pass = 0; pass < 3; ++pass) {
    CHECK(!session.writer.due(now_us + kMinuteUs - 1));
    now_us += kMinuteUs;
    CHECK(session.next_is(BlockKind::kSchema, now_us));
    CHECK(!session.writer.take_identities_due());
    CHECK(session.next_is(BlockKind::kSchema, now_us + 5));
    CHECK(session.writer.take_identities_due());
    CHECK(!session.writer.due(now_us + 5));
  }
}

TEST_CASE("a look that comes late still finds the schema due") {
  Session session;
  session.start(0);
  CHECK(session.next_is(BlockKind::kSchema, kMinuteUs + 700));
}

TEST_CASE("a pass that frames held up for more than a minute does not begin anew") {
  Session session;
  session.start(0);
  CHECK(session.next_is(BlockKind::kSchema, kMinuteUs));
  session.push(24, 0);
  CHECK(session.next_is(BlockKind::kFrames, 2 * kMinuteUs + 5));
  session.take(2 * kMinuteUs + 5);
  CHECK_EQ(core::get_le<uint16_t>(block + core::kBlockHeaderSize), kPiece);
}

TEST_CASE("finished at the head: the schema still goes out; finished later: it does not return") {
  Session session;
  session.writer.start(5, 6, 0, 0);
  CHECK(!session.writer.drained());
  session.push(1, 0);
  session.writer.finish();
  CHECK(session.next_is(BlockKind::kSchema, 0));
  CHECK(session.next_is(BlockKind::kSchema, 0));
  CHECK(session.next_is(BlockKind::kFrames, 0));
  CHECK(session.writer.drained());
  CHECK(!session.writer.due(kMinuteUs));
  CHECK(!session.writer.schema_pass());
}

TEST_CASE("drained needs all three: the end asked for, nothing due, nothing waiting") {
  Session session;
  session.start(0);
  CHECK(!session.writer.drained());
  CHECK(session.writer.due(kMinuteUs));
  session.writer.finish();
  CHECK(!session.writer.drained());
  session.take(kMinuteUs);
  CHECK(session.writer.drained());
  session.push(0, 1);
  CHECK(!session.writer.drained());
}

TEST_CASE("the next session counts anew and forgets what the last left half done") {
  Session session;
  session.start(0);
  session.push(24, 0);
  CHECK(session.writer.due(1));
  Card card;
  session.writer.stream(card, 100);
  session.writer.finish();
  CHECK(session.writer.blocks_written() == 2U);
  session.writer.start(8, 9, 1000, 7);
  CHECK(session.writer.blocks_written() == 0U);
  CHECK(session.writer.sequence() == 1000U);
  CHECK(session.writer.session() == 9U);
  CHECK_EQ(session.ring.used(), 0);
  CHECK(session.writer.take_identities_due());
  const core::BlockHeader header = session.take(7);
  CHECK(header.kind == BlockKind::kSchema);
  CHECK(header.file_id == 8U);
  CHECK(header.session == 9U);
  CHECK(header.sequence == 1000U);
  CHECK_EQ(core::get_le<uint16_t>(block + core::kBlockHeaderSize), 0);
  CHECK(session.writer.sequence() == 1001U);
  CHECK(session.next_is(BlockKind::kSchema, 7));
  CHECK(!session.writer.due(7 + kMinuteUs - 1));
  CHECK(session.writer.due(7 + kMinuteUs));
}

TEST_CASE("a skip is no block written; what follows is the same content from its start") {
  Session session;
  session.start(0);
  session.push(24, 0);
  REQUIRE(session.writer.due(1));
  Card card;
  session.writer.stream(card, 100);
  session.writer.skip();
  CHECK(session.writer.blocks_written() == 2U);
  CHECK(session.writer.sequence() == 3U);
  const core::BlockHeader header = session.take(1);
  CHECK(header.sequence == 3U);
  CHECK_EQ(header.used, core::kBlockPayloadSize);
  CHECK(session.writer.blocks_written() == 3U);
}
