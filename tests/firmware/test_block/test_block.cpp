// The shared block cases of protocol/cases.toml, and the identity of a file.
#include <string.h>

#include "check.h"
#include "core/block.h"
#include "core/bytes.h"
#include "core/crc.h"
#include "generated/cases.h"
#include "generated/frames.h"

namespace {

uint8_t block[core::kBlockSize];

void check_frames(const cases::BlockCase& truth) {
  uint16_t offset = 0;
  uint8_t count = 0;
  const uint8_t* expected = truth.frames;
  for (uint8_t size = core::frame_at(block, truth.used, 0); size != 0;
       size = core::frame_at(block, truth.used, offset)) {
    uint8_t bytes[frames::kMaxWireSize + 1];
    cases::copy(bytes, expected, static_cast<size_t>(size) + 1);
    expected += size + 1;
    CHECK_EQ(bytes[0], size);
    CHECK(memcmp(bytes + 1, block + core::kBlockHeaderSize + offset, size) == 0);
    offset = static_cast<uint16_t>(offset + size);
    ++count;
  }
  CHECK_EQ(count, truth.frame_count);
  CHECK_EQ(truth.used - offset, truth.unread);
}

void check_case(const cases::BlockCase& truth) {
  cases::expand(truth, block);
  core::BlockHeader header = {};
  const core::BlockVerdict verdict = core::check_block(block, header);
  CHECK_EQ(static_cast<uint8_t>(verdict), static_cast<uint8_t>(truth.verdict));
  if (truth.verdict != cases::Verdict::kOk) {
    return;
  }
  CHECK(header.file_id == truth.file_id);
  CHECK(header.session == truth.session);
  CHECK(header.sequence == truth.sequence);
  CHECK(header.schema_hash == truth.schema_hash);
  CHECK(header.dropped == truth.dropped);
  CHECK_EQ(header.used, truth.used);
  CHECK_EQ(static_cast<uint8_t>(header.kind), truth.kind);
  if (header.kind == core::BlockKind::kFrames) {
    check_frames(truth);
  }
}

}  // namespace

TEST_CASE("every block case of the protocol") {
  for (uint8_t i = 0; i < cases::kBlockCaseCount; ++i) {
    check_case(cases::load(&cases::kBlockCases[i]));
  }
}

TEST_CASE("the header is written as it is read") {
  const core::BlockHeader header = {
      0x11223344U, 5, 0xFFFFFFFEU, 0x55667788U, 9, 17, core::BlockKind::kSchema};
  uint8_t bytes[core::kBlockHeaderSize + 4];
  memset(bytes, 0xEE, sizeof(bytes));
  core::put_block_header(bytes, header);
  CHECK(memcmp(bytes, "FLT1", 4) == 0);
  CHECK(core::get_le<uint32_t>(bytes + 4) == header.file_id);
  CHECK(core::get_le<uint32_t>(bytes + 12) == header.sequence);
  CHECK_EQ(bytes[26], 1);
  CHECK_EQ(bytes[27], 0);
  CHECK_EQ(bytes[28], 0xEE);
}

TEST_CASE("an event is found among other frames") {
  memset(block, 0, sizeof(block));
  uint8_t* payload = block + core::kBlockHeaderSize;
  payload[0] = frames::kMagId;
  payload[11] = frames::kEventId;
  payload[11 + 5] = static_cast<uint8_t>(frames::Event::kSessionEnd);
  const uint8_t end = static_cast<uint8_t>(frames::Event::kSessionEnd);
  CHECK(core::block_has_event(block, 21, end));
  CHECK(!core::block_has_event(block, 20, end));
  CHECK(!core::block_has_event(block, 21, static_cast<uint8_t>(end + 1)));
}

TEST_CASE("a file id depends on card, session and old content") {
  uint8_t cid[16] = {1, 2, 3};
  memset(block, 0xFF, sizeof(block));
  const uint32_t id = core::make_file_id(cid, 7, block);
  CHECK(core::make_file_id(cid, 8, block) != id);
  block[511] = 0xFE;
  CHECK(core::make_file_id(cid, 7, block) != id);
  block[511] = 0xFF;
  cid[15] = 1;
  CHECK(core::make_file_id(cid, 7, block) != id);
  cid[15] = 0;
  CHECK(core::make_file_id(cid, 7, block) == id);
}

TEST_CASE("every field of a header stands at its place, and comes back from it") {
  memset(block, 0, sizeof(block));
  const core::BlockHeader header = {0x04030201U,
                                    0x08070605U,
                                    0x0C0B0A09U,
                                    0x100F0E0DU,
                                    0x14131211U,
                                    0x0116,
                                    core::BlockKind::kSchema};
  core::put_block_header(block, header);
  CHECK(memcmp(block, "FLT1", 4) == 0);
  for (uint8_t i = 0; i < 20; ++i) {
    CHECK_EQ(block[4 + i], i + 1);
  }
  CHECK_EQ(block[24], 0x16);
  CHECK_EQ(block[25], 0x01);
  CHECK_EQ(block[26], 1);
  CHECK_EQ(block[27], 0);
  core::Crc32 crc;
  crc.add(block, 508);
  core::put_le(block + 508, crc.value());
  core::BlockHeader read = {};
  REQUIRE(core::check_block(block, read) == core::BlockVerdict::kOk);
  CHECK(read.file_id == header.file_id);
  CHECK(read.session == header.session);
  CHECK(read.sequence == header.sequence);
  CHECK(read.schema_hash == header.schema_hash);
  CHECK(read.dropped == header.dropped);
  CHECK_EQ(read.used, header.used);
  CHECK(read.kind == header.kind);
}

TEST_CASE("the first frame of an id is found wherever it stands, and none where there is none") {
  memset(block, 0xA5, sizeof(block));
  uint8_t* payload = block + core::kBlockHeaderSize;
  const uint8_t ids[] = {
      frames::kMagId, frames::kEventId, frames::kMagId, frames::kFileId, frames::kEventId};
  uint16_t starts[6] = {};
  for (uint8_t i = 0; i < 5; ++i) {
    const uint8_t size = frames::wire_size(ids[i]);
    payload[starts[i]] = ids[i];
    // What a frame holds is no id: each byte is that of another kind.
    for (uint8_t k = 1; k < size; ++k) {
      payload[starts[i] + k] = ids[i] == frames::kMagId ? frames::kEventId : frames::kMagId;
    }
    payload[starts[i] + 5] = static_cast<uint8_t>(100 + i);
    starts[i + 1] = static_cast<uint16_t>(starts[i] + size);
  }
  const uint16_t used = starts[5];
  CHECK(core::find_frame(block, used, frames::kMagId) == payload);
  CHECK(core::find_frame(block, used, frames::kEventId) == payload + starts[1]);
  CHECK(core::find_frame(block, used, frames::kFileId) == payload + starts[3]);
  CHECK(core::find_frame(block, used, frames::kIdentId) == nullptr);
  CHECK(core::find_frame(block, 0, frames::kMagId) == nullptr);
  CHECK(core::find_frame(block, starts[3], frames::kFileId) == nullptr);
  CHECK(core::find_frame(block, static_cast<uint16_t>(starts[4] - 1), frames::kFileId) == nullptr);
  CHECK(core::find_frame(block, starts[4], frames::kFileId) == payload + starts[3]);
  CHECK(core::block_has_event(block, used, 101));
  CHECK(core::block_has_event(block, used, 104));
  CHECK(!core::block_has_event(block, used, 100));
  CHECK(!core::block_has_event(block, used, 103));
  CHECK(!core::block_has_event(block, static_cast<uint16_t>(used - 1), 104));
  // A damaged block: what `used` counts may end before the place that is asked for.
  CHECK_EQ(core::frame_at(block, starts[1], starts[1]), 0);
  CHECK_EQ(core::frame_at(block, starts[1], starts[2]), 0);
  CHECK_EQ(core::frame_at(block, starts[2], starts[1]), frames::kEventWireSize);
  payload[0] = 0xFF;
  CHECK(core::find_frame(block, used, frames::kEventId) == nullptr);
}

TEST_CASE("a file id is the CRC-32 of card, session and old block, in this order") {
  uint8_t bytes[16 + 4 + core::kBlockSize];
  for (uint16_t i = 0; i < sizeof(bytes); ++i) {
    bytes[i] = static_cast<uint8_t>(i * 31U + 7U);
  }
  uint32_t definition = 0xFFFFFFFFU;
  for (const uint8_t byte : bytes) {
    definition ^= byte;
    for (uint8_t bit = 0; bit < 8; ++bit) {
      definition = (definition & 1U) != 0 ? definition >> 1 ^ 0xEDB88320U : definition >> 1;
    }
  }
  const uint32_t session = core::get_le<uint32_t>(bytes + 16);
  CHECK(core::make_file_id(bytes, session, bytes + 20) == ~definition);
}
