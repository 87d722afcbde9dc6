// Frames in, blocks out, in any order of pushing, streaming, refusing and skipping: every block the
// card takes is whole, and the accepted ones hold the pushed frames in order, less those counted.
#include "core/block_writer.h"
#include "core/block.h"
#include "core/bytes.h"
#include "feed.h"

namespace {

constexpr uint16_t kSchemaSize = 1000;
constexpr uint16_t kMostFrames = 4096;

struct Card {
  uint8_t block[core::kBlockSize];
  uint16_t at = 0;
  void put(const uint8_t* data, uint16_t size, core::Crc32& crc) {
    crc.add(data, size);
    ALWAYS(at + size <= core::kBlockSize);
    memcpy(block + at, data, size);
    at = static_cast<uint16_t>(at + size);
  }
};

// Number of every frame that found room, in order; and how many blocks have taken.
uint32_t g_stored[kMostFrames];
uint16_t g_stored_count;
uint16_t g_taken;
uint32_t g_refused;
uint32_t g_told;  // dropped, as the events say

void take_frames(const uint8_t* block, uint16_t used) {
  uint16_t offset = 0;
  while (const uint8_t size = core::frame_at(block, used, offset)) {
    const uint8_t* frame = block + core::kBlockHeaderSize + offset;
    if (frame[0] == frames::EventFrame::id()) {
      frames::EventFrame event;
      memcpy(&event, frame + 1, sizeof event);
      if (event.code == static_cast<uint8_t>(frames::Event::kFramesDropped)) {
        g_told += event.arg;
        offset = static_cast<uint16_t>(offset + size);
        continue;
      }
    }
    ALWAYS(g_taken < g_stored_count);
    ALWAYS(core::get_le<uint32_t>(frame + 1) == g_stored[g_taken]);
    ++g_taken;
    offset = static_cast<uint16_t>(offset + size);
  }
  ALWAYS(offset == used);
}

template <typename Frame>
void push(core::ByteRing& ring, uint32_t number) {
  Frame frame;
  memset(&frame, 0x5A, sizeof frame);
  frame.t_us = number;
  if (ring.push(frame)) {
    g_stored[g_stored_count++] = number;
  } else {
    ++g_refused;
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  static char schema[kSchemaSize];
  memset(schema, 's', sizeof schema);
  Feed feed(bytes, size);
  const uint16_t capacity = static_cast<uint16_t>(520 + feed.u16() % 2000);
  uint8_t* buffer = static_cast<uint8_t*>(malloc(capacity));
  core::ByteRing ring(buffer, capacity);
  core::BlockWriter writer(ring, schema, kSchemaSize, 0x12345678U);
  const uint32_t first = feed.u32() & 0x7FFFFFFFU;
  uint32_t now_us = feed.u32();
  writer.start(0xF11E, 9, first, now_us);
  g_stored_count = g_taken = 0;
  g_refused = g_told = 0;
  Card card;
  bool due = false;
  bool finishing = false;
  uint32_t number = 1;
  uint32_t blocks = 0;
  while (feed.more() && g_stored_count < kMostFrames - 64) {
    const uint8_t what = feed.u8();
    switch (what & 0x07) {
      case 0:
      case 1:
        for (uint8_t left = what >> 4; left != 0; --left) {
          if (finishing) break;
          push<frames::IdentFrame>(ring, number++);
        }
        break;
      case 2:
        if (!finishing) push<frames::BaroFrame>(ring, number++);
        break;
      case 3:
        if (!finishing && ring.push_event(frames::Event::kMark, what, number)) {
          g_stored[g_stored_count++] = number++;
        }
        break;
      case 4:
        now_us += static_cast<uint32_t>(feed.u16()) << 10;
        (void)writer.take_identities_due();
        break;
      case 5:
        if (what == 0xFD) {
          finishing = true;
          writer.finish();
        }
        break;
      default:
        if (!due) due = writer.due(now_us);
        if (!due) break;
        if (!writer.stream(card, static_cast<uint16_t>(1 + feed.u8() * 2U))) break;
        core::BlockHeader header = {};
        ALWAYS(card.at == core::kBlockSize);
        ALWAYS(core::check_block(card.block, header) == core::BlockVerdict::kOk);
        ALWAYS(header.sequence == writer.sequence());
        ALWAYS(header.file_id == 0xF11E && header.session == 9);
        card.at = 0;
        if ((what & 0x18) == 0) {
          writer.rejected();
        } else if ((what & 0x18) == 8) {
          writer.skip();
        } else {
          if (header.kind == core::BlockKind::kFrames) take_frames(card.block, header.used);
          writer.accepted();
          due = false;
          ++blocks;
          ALWAYS(writer.blocks_written() == blocks);
        }
        break;
    }
    ALWAYS(ring.used() <= capacity);
    ALWAYS(ring.dropped() >= g_refused);
  }
  // The end: what was stored comes out, whatever was refused and skipped before.
  writer.finish();
  for (uint16_t turns = 0; !writer.drained(); ++turns) {
    ALWAYS(turns < 200);
    ALWAYS(due || writer.due(now_us));
    while (!writer.stream(card, 512)) {
    }
    core::BlockHeader header = {};
    ALWAYS(core::check_block(card.block, header) == core::BlockVerdict::kOk);
    card.at = 0;
    if (header.kind == core::BlockKind::kFrames) take_frames(card.block, header.used);
    writer.accepted();
    due = false;
  }
  ALWAYS(g_taken == g_stored_count);
  ALWAYS(g_told <= ring.dropped());
  free(buffer);
  return 0;
}
