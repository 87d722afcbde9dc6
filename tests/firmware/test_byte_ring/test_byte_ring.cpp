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

namespace {

// Fills a ring with events, which may use all of it, and frees `room` bytes behind the rest.
void leave(core::ByteRing& ring, uint16_t room) {
  ring.clear();
  while (ring.free() >= room + frames::kEventWireSize) {
    ring.push_event(frames::Event::kMark, 0, 0);
  }
}

}  // namespace

TEST_CASE("a ring that was used is empty at its first byte when it is cleared") {
  core::ByteRing ring(buffer, kCapacity);
  ring.push(mag(1));
  ring.push(mag(2));
  ring.consume(frames::kMagWireSize);
  ring.push(200, buffer, 5);
  ring.clear();
  CHECK_EQ(ring.used(), 0);
  CHECK_EQ(ring.free(), kCapacity);
  CHECK_EQ(ring.capacity(), kCapacity);
  CHECK_EQ(ring.dropped(), 0U);
  CHECK_EQ(ring.take_free_min(), kCapacity);
  ring.push(mag(3));
  CHECK_EQ(ring.used(), frames::kMagWireSize);  // nothing is told of before
  uint16_t size = 0;
  CHECK(ring.run(0, 400, size) == buffer);
}

TEST_CASE("each byte of room decides: 40 left for a frame, none for an event") {
  // 400 - 39 * 10: as `capacity` grows, so does what is left behind the same events.
  for (uint16_t extra = 0; extra <= 60; ++extra) {
    core::ByteRing ring(buffer, static_cast<uint16_t>(300 + extra));
    for (uint8_t i = 0; i < 30; ++i) {
      REQUIRE(ring.push_event(frames::Event::kMark, 0, 0));
    }
    REQUIRE(ring.free() == extra);
    CHECK_EQ(ring.push(mag(1)), extra >= frames::kMagWireSize + kReserve);
    core::ByteRing other(buffer, static_cast<uint16_t>(300 + extra));
    for (uint8_t i = 0; i < 30; ++i) {
      other.push_event(frames::Event::kMark, 0, 0);
    }
    CHECK_EQ(other.push_event(frames::Event::kMark, 0, 0), extra >= frames::kEventWireSize);
  }
}

TEST_CASE(
    "behind a drop a small frame waits for room for the identification frame and the notice") {
  const uint16_t wanted = frames::kIdentWireSize + frames::kEventWireSize + kReserve;
  for (uint16_t extra = static_cast<uint16_t>(wanted - 2); extra <= wanted + 2; ++extra) {
    core::ByteRing ring(buffer, static_cast<uint16_t>(200 + extra));
    for (uint8_t i = 0; i < 20; ++i) {
      ring.push_event(frames::Event::kMark, 0, 0);
    }
    ring.push(200, buffer, 5);  // dropped, for there is no such frame
    CHECK_EQ(ring.push(mag(1)), extra >= wanted);
    CHECK_EQ(ring.used(),
             200 + (extra >= wanted ? frames::kMagWireSize + frames::kEventWireSize : 0));
  }
  // The identification frame itself, and what is longer, ask for their own size.
  uint8_t fields[frames::kMaxWireSize] = {};
  for (uint8_t id = 1; id < 255; ++id) {
    const uint8_t size = frames::wire_size(id);
    if (size < frames::kIdentWireSize || id == frames::kEventId) {
      continue;
    }
    const uint16_t least = static_cast<uint16_t>(size + frames::kEventWireSize + kReserve);
    for (uint16_t extra = static_cast<uint16_t>(least - 1); extra <= least; ++extra) {
      core::ByteRing ring(buffer, static_cast<uint16_t>(100 + extra));
      for (uint8_t i = 0; i < 10; ++i) {
        ring.push_event(frames::Event::kMark, 0, 0);
      }
      ring.push(200, fields, 5);
      CHECK_EQ(ring.push(id, fields, 6), extra == least);
    }
  }
}

TEST_CASE("a notice needs its ten bytes and no more, and an event squeezed in tells of nothing") {
  for (uint16_t room = 0; room < 10; ++room) {
    core::ByteRing ring(buffer, static_cast<uint16_t>(100 + room + 10));
    for (uint8_t i = 0; i < 10; ++i) {
      ring.push_event(frames::Event::kMark, 0, 0);
    }
    ring.push(200, buffer, 5);
    CHECK(ring.push_event(frames::Event::kMark, 0, 0));
    CHECK_EQ(ring.used(), 110);
    CHECK(!ring.tell_dropped());
    ring.consume(ring.whole(static_cast<uint16_t>(10 - room)));
    CHECK_EQ(ring.tell_dropped(), room == 0);
  }
}

TEST_CASE("more drops than a notice counts: it says 65535, the total goes on") {
  core::ByteRing ring(buffer, kCapacity);
  for (uint32_t i = 0; i < 65540U; ++i) {
    ring.push(200, buffer, i + 3);
  }
  CHECK_EQ(ring.dropped(), 65540U);
  CHECK(ring.tell_dropped());
  const frames::EventFrame event = oldest_event(ring);
  CHECK_EQ(event.arg, 65535U);
  CHECK_EQ(event.t_us, 3U);
}

TEST_CASE("what fits whole is counted to the byte, and a run ends at the seam") {
  core::ByteRing ring(buffer, kCapacity);
  leave(ring, 50);
  ring.consume(ring.whole(200));
  CHECK_EQ(ring.used(), 150);
  CHECK_EQ(ring.whole(0), 0);
  CHECK_EQ(ring.whole(9), 0);
  CHECK_EQ(ring.whole(10), 10);
  CHECK_EQ(ring.whole(19), 10);
  CHECK_EQ(ring.whole(149), 140);
  CHECK_EQ(ring.whole(150), 150);
  CHECK_EQ(ring.whole(480), 150);
  for (uint8_t i = 0; i < 10; ++i) {
    ring.push_event(frames::Event::kMark, i, i);
  }
  // 200 to 400 and from the first byte on.
  uint16_t size = 0;
  CHECK(ring.run(0, 480, size) == buffer + 200);
  CHECK_EQ(size, 200);
  CHECK(ring.run(199, 480, size) == buffer + 399);
  CHECK_EQ(size, 1);
  CHECK(ring.run(200, 50, size) == buffer);
  CHECK_EQ(size, 50);
  CHECK(ring.run(0, 200, size) == buffer + 200);
  CHECK_EQ(size, 200);
  CHECK(ring.run(0, 199, size) == buffer + 200);
  CHECK_EQ(size, 199);
  CHECK_EQ(ring.whole(480), 250);
  ring.consume(200);
  CHECK(ring.run(0, 480, size) == buffer);
}

TEST_CASE("the least room is that behind each frame, seen once") {
  core::ByteRing ring(buffer, kCapacity);
  ring.push(mag(1));
  ring.consume(frames::kMagWireSize);
  ring.push_event(frames::Event::kMark, 0, 0);
  CHECK_EQ(ring.take_free_min(), kCapacity - frames::kMagWireSize);
  CHECK_EQ(ring.take_free_min(), kCapacity - frames::kEventWireSize);
}
