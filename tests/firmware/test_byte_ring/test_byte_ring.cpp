// The ring against a simple model: a list of frames with the same room.
#include <string.h>

#include "check.h"
#include "core/byte_ring.h"
#include "core/bytes.h"
#include "generated/frames.h"
#include "random_numbers.h"

namespace {

constexpr uint16_t kCapacity = 400;
constexpr uint16_t kReserve = 40;  // what only events may use
uint8_t buffer[kCapacity + 2];

frames::MagFrame mag(uint32_t t_us) {
  frames::MagFrame frame;
  frame.t_us = t_us;
  frame.mx = static_cast<int16_t>(t_us * 3);
  frame.my = 0;
  frame.mz = -1;
  return frame;
}

// Copies the oldest `size` bytes out.
void peek(const core::ByteRing& ring, uint8_t* to, uint16_t size) {
  uint16_t offset = 0;
  while (offset < size) {
    uint16_t piece = 0;
    const uint8_t* bytes = ring.run(offset, static_cast<uint16_t>(size - offset), piece);
    memcpy(to + offset, bytes, piece);
    offset = static_cast<uint16_t>(offset + piece);
  }
}

frames::EventFrame oldest_event(core::ByteRing& ring) {
  uint8_t bytes[frames::kEventWireSize];
  peek(ring, bytes, sizeof(bytes));
  frames::EventFrame event;
  memcpy(&event, bytes + 1, sizeof(event));
  ring.consume(sizeof(bytes));
  return event;
}

}  // namespace

TEST_CASE("frames come out whole and in order, over the seam too") {
  core::ByteRing ring(buffer, kCapacity);
  uint8_t wrong = 0;
  for (uint32_t t_us = 0; t_us < 500; ++t_us) {
    wrong = static_cast<uint8_t>(wrong + (ring.push(mag(t_us)) ? 0 : 1));
    uint8_t bytes[frames::kMagWireSize];
    peek(ring, bytes, sizeof(bytes));
    const frames::MagFrame frame = mag(t_us);
    if (ring.whole(480) != sizeof(bytes) || bytes[0] != frames::kMagId ||
        memcmp(bytes + 1, &frame, sizeof(frame)) != 0) {
      ++wrong;
    }
    ring.consume(sizeof(bytes));
  }
  CHECK_EQ(wrong, 0);
  CHECK_EQ(ring.used(), 0);
}

TEST_CASE("a full ring drops the newest, counts it and says so before the next frame") {
  core::ByteRing ring(buffer, kCapacity);
  uint32_t t_us = 100;
  while (ring.push(mag(t_us))) {
    ++t_us;
  }
  const uint32_t first_dropped_us = t_us;
  CHECK(ring.free() < frames::kMagWireSize + kReserve);
  CHECK(!ring.push(mag(t_us + 1)));
  CHECK(!ring.push(mag(t_us + 2)));
  CHECK(ring.dropped() == 3U);
  const uint16_t before = ring.used();
  ring.consume(ring.whole(100));
  CHECK(ring.push(mag(t_us + 3)));
  // The old frames stand untouched, behind them the notice.
  const uint16_t kept = static_cast<uint16_t>(before - 99);
  ring.consume(kept);
  const frames::EventFrame event = oldest_event(ring);
  CHECK_EQ(event.code, static_cast<uint8_t>(frames::Event::kFramesDropped));
  const uint32_t arg = event.arg;
  const uint32_t when_us = event.t_us;
  CHECK(arg == 3U);
  CHECK(when_us == first_dropped_us);
  CHECK_EQ(ring.used(), frames::kMagWireSize);
  // Once told, not told again; the total stays.
  CHECK(ring.push(mag(t_us + 4)));
  CHECK_EQ(ring.used(), 2 * frames::kMagWireSize);
  CHECK(ring.dropped() == 3U);
}

TEST_CASE("events find room that other frames leave") {
  core::ByteRing ring(buffer, kCapacity);
  while (ring.push(mag(1))) {
  }
  CHECK(ring.push_event(frames::Event::kCardStall, 400, 2));
  CHECK(!ring.push(mag(3)));
}

TEST_CASE("what was dropped last is told when asked, in the room of events") {
  core::ByteRing ring(buffer, kCapacity);
  CHECK(ring.tell_dropped());
  CHECK_EQ(ring.used(), 0);
  while (ring.push(mag(7))) {
  }
  CHECK(!ring.push(mag(9)));
  CHECK(ring.tell_dropped());
  const uint16_t used = ring.used();
  CHECK(ring.tell_dropped());
  CHECK_EQ(ring.used(), used);
  ring.consume(ring.whole(static_cast<uint16_t>(used - frames::kEventWireSize)));
  const frames::EventFrame event = oldest_event(ring);
  CHECK_EQ(event.code, static_cast<uint8_t>(frames::Event::kFramesDropped));
  CHECK_EQ(event.arg, 2U);
  CHECK_EQ(event.t_us, 7U);
}

TEST_CASE("no room for a word of it: told later") {
  core::ByteRing ring(buffer, kCapacity);
  while (ring.push(mag(7))) {
  }
  while (ring.push_event(frames::Event::kMark, 1, 8)) {
  }
  CHECK(!ring.tell_dropped());
  ring.consume(ring.whole(100));
  CHECK(ring.tell_dropped());
}

TEST_CASE("an unknown id is dropped, not stored") {
  core::ByteRing ring(buffer, kCapacity);
  const uint8_t fields[4] = {};
  CHECK(!ring.push(200, fields, 1));
  CHECK_EQ(ring.used(), 0);
  CHECK(ring.dropped() == 1U);
}

TEST_CASE("the least free room is remembered until it is asked for") {
  core::ByteRing ring(buffer, kCapacity);
  CHECK_EQ(ring.take_free_min(), kCapacity);
  CHECK(ring.push(mag(1)));
  CHECK(ring.push(mag(2)));
  ring.consume(frames::kMagWireSize);
  CHECK_EQ(ring.take_free_min(), kCapacity - 22);
  CHECK_EQ(ring.take_free_min(), kCapacity - 11);
}

TEST_CASE("random pushes and blocks: what was accepted comes out, what was dropped is counted") {
  memset(buffer, 0xEE, sizeof(buffer));
  core::ByteRing ring(buffer, kCapacity);
  Random random(3);
  uint32_t next = 0;  // number given to the next frame
  uint32_t accepted = 0;
  uint32_t told = 0;  // drops told by events
  uint32_t seen = 0;
  uint32_t expected = 0;  // number of the next frame to come out
  uint8_t wrong = 0;
  for (uint16_t turn = 0; turn < 4000; ++turn) {
    if (random.byte() < 243) {
      accepted += ring.push(mag(next)) ? 1U : 0U;
      ++next;
    } else {
      uint16_t left = ring.whole(static_cast<uint16_t>(random.byte() + 60));
      while (left != 0) {
        uint8_t bytes[frames::kMagWireSize];
        peek(ring, bytes, 1);
        const uint8_t size = frames::wire_size(bytes[0]);
        peek(ring, bytes, size);
        if (bytes[0] == frames::kEventId) {
          const uint32_t dropped = core::get_le<uint32_t>(bytes + 6);
          wrong = static_cast<uint8_t>(wrong + (core::get_le<uint32_t>(bytes + 1) != expected));
          told += dropped;
          expected += dropped;
        } else {
          wrong = static_cast<uint8_t>(wrong + (core::get_le<uint32_t>(bytes + 1) != expected));
          ++expected;
          ++seen;
        }
        ring.consume(size);
        left = static_cast<uint16_t>(left - size);
      }
    }
    wrong = static_cast<uint8_t>(wrong + (ring.used() > kCapacity));
  }
  CHECK_EQ(wrong, 0);
  CHECK(seen > 1000U);
  CHECK(told > 300U);
  CHECK(accepted + ring.dropped() == next);
  CHECK_EQ(buffer[kCapacity], 0xEE);
}

TEST_CASE("a closed ring lends its memory and takes no frame; an open one lends nothing") {
  uint8_t memory[128];
  core::ByteRing lender(memory, sizeof(memory));
  lender.clear();
  CHECK(lender.lend() == nullptr);
  CHECK(lender.push_event(frames::Event::kMark, 1, 0));
  lender.close();
  CHECK_EQ(lender.used(), 0);
  REQUIRE(lender.lend() == memory);
  memset(memory, 0x5A, sizeof(memory));
  CHECK(!lender.push_event(frames::Event::kMark, 2, 0));
  CHECK(lender.tell_dropped());
  for (const uint8_t byte : memory) {
    CHECK_EQ(byte, 0x5A);
  }
  CHECK_EQ(lender.dropped(), 0U);
  lender.clear();
  CHECK(lender.lend() == nullptr);
  CHECK(lender.push_event(frames::Event::kMark, 3, 0));
}
