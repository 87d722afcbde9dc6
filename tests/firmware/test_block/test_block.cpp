// The shared block cases of protocol/cases.toml, and the identity of a file.
#include <string.h>

#include "check.h"
#include "core/block.h"
#include "core/bytes.h"
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
