// UBX byte by byte: events, words, the lengths that are taken, and where it begins anew.
#include <string.h>

#include "check.h"
#include "core/bytes.h"
#include "core/ubx.h"

namespace {

using core::UbxEvent;

uint8_t bytes[600];

// Any length, as `put_ubx` cannot.
uint16_t put(uint16_t length) {
  const uint8_t head[] = {
      0xB5, 0x62, 0x0A, 0x31, static_cast<uint8_t>(length), static_cast<uint8_t>(length >> 8)};
  memcpy(bytes, head, sizeof(head));
  uint8_t a = 0;
  uint8_t b = 0;
  for (uint16_t i = 2; i < length + 6U; ++i) {
    if (i >= 6) {
      bytes[i] = static_cast<uint8_t>(i * 3 + 1);
    }
    a = static_cast<uint8_t>(a + bytes[i]);
    b = static_cast<uint8_t>(b + a);
  }
  bytes[length + 6] = a;
  bytes[length + 7] = b;
  return static_cast<uint16_t>(length + 8);
}

}  // namespace

TEST_CASE("UBX: every word at its offset, the message behind its sums, at every length") {
  const uint16_t lengths[] = {0, 1, 3, 4, 5, 8, 52, 92, 255, 256, 257, 511, 512};
  core::UbxParser parser;
  for (const uint16_t length : lengths) {
    const uint16_t size = put(length);
    uint16_t words = 0;
    for (uint16_t i = 0; i < size; ++i) {
      const UbxEvent event = parser.byte(bytes[i], 1000U + i);
      const bool word = i >= 6 && i < length + 6U && (i - 6) % 4 == 3;
      CHECK(event == (i + 1 == size ? UbxEvent::kMessage
                      : word        ? UbxEvent::kWord
                                    : UbxEvent::kNone));
      if (word) {
        CHECK_EQ(parser.offset(), i - 9);
        CHECK_EQ(parser.word(), core::get_le<uint32_t>(bytes + i - 3));
        CHECK_EQ(parser.message_class(), 0x0A);
        CHECK_EQ(parser.message_id(), 0x31);
        CHECK_EQ(parser.length(), length);
        ++words;
      }
    }
    CHECK_EQ(words, length / 4);
    CHECK_EQ(parser.first_byte_us(), 1000U);
  }
}

TEST_CASE("UBX: more than 512 bytes are an error at once, and what follows is a beginning") {
  const uint16_t lengths[] = {513, 514, 0xB510, 0xFFFF};
  for (const uint16_t length : lengths) {
    core::UbxParser parser;
    put(4);
    core::put_le(bytes + 4, length);
    for (uint8_t i = 0; i < 5; ++i) {
      CHECK(parser.byte(bytes[i], i) == UbxEvent::kNone);
    }
    CHECK(parser.byte(bytes[5], 55) == UbxEvent::kError);
    const uint16_t size = put(4);
    // 0xB5 as the upper byte of the length may be the next message's first.
    for (uint16_t i = length == 0xB510 ? 1 : 0; i + 1 < size; ++i) {
      const UbxEvent event = parser.byte(bytes[i], 100U + i);
      CHECK((event == UbxEvent::kNone || event == UbxEvent::kWord));
    }
    CHECK(parser.byte(bytes[size - 1], 0) == UbxEvent::kMessage);
    CHECK_EQ(parser.first_byte_us(), length == 0xB510 ? 55U : 100U);
  }
}

TEST_CASE(
    "UBX: each sum that is wrong is an error there, and may be the next message's first byte") {
  for (uint8_t which = 0; which < 2; ++which) {
    for (uint8_t sync = 0; sync < 2; ++sync) {
      core::UbxParser parser;
      uint16_t size = put(4);
      const uint8_t at = static_cast<uint8_t>(size - 2 + which);
      for (uint8_t i = 0; i < at; ++i) {
        CHECK(parser.byte(bytes[i], i) != UbxEvent::kError);
      }
      CHECK(parser.byte(sync != 0 ? 0xB5 : static_cast<uint8_t>(bytes[at] + 1), 77) ==
            UbxEvent::kError);
      size = put(0);
      for (uint16_t i = sync; i + 1 < size; ++i) {
        CHECK(parser.byte(bytes[i], 200U + i) == UbxEvent::kNone);
      }
      CHECK(parser.byte(bytes[size - 1], 0) == UbxEvent::kMessage);
      CHECK_EQ(parser.first_byte_us(), sync != 0 ? 77U : 200U);
    }
  }
}

TEST_CASE("UBX: a first sync byte twice, or alone, costs nothing") {
  core::UbxParser parser;
  const uint16_t size = put(4);
  CHECK(parser.byte(0x62, 1) == UbxEvent::kNone);
  CHECK(parser.byte(0xB5, 2) == UbxEvent::kNone);
  CHECK(parser.byte(0x00, 3) == UbxEvent::kNone);
  CHECK(parser.byte(0x62, 4) == UbxEvent::kNone);
  CHECK(parser.byte(0xB5, 5) == UbxEvent::kNone);
  CHECK(parser.byte(0xB5, 6) == UbxEvent::kNone);
  for (uint16_t i = 1; i + 1 < size; ++i) {
    CHECK(parser.byte(bytes[i], 10U + i) != UbxEvent::kError);
  }
  CHECK(parser.byte(bytes[size - 1], 0) == UbxEvent::kMessage);
  CHECK_EQ(parser.first_byte_us(), 6U);
}

TEST_CASE("UBX: a message is built byte by byte, and nothing behind it is touched") {
  uint8_t payload[8];
  for (uint8_t size = 0; size <= sizeof(payload); ++size) {
    put(size);
    memcpy(payload, bytes + 6, size);
    uint8_t built[20];
    memset(built, 0xEE, sizeof(built));
    CHECK_EQ(core::put_ubx(built, 0x0A, 0x31, payload, size), size + 8);
    CHECK_EQ(memcmp(built, bytes, static_cast<size_t>(size) + 8), 0);
    CHECK_EQ(built[size + 8], 0xEE);
  }
}

TEST_CASE("UBX: only the first sync byte itself begins anew behind an error") {
  for (uint16_t other = 0; other < 256; ++other) {
    core::UbxParser parser;
    uint16_t size = put(4);
    const uint8_t wrong = static_cast<uint8_t>(other);
    if (wrong == bytes[size - 1]) {
      continue;
    }
    for (uint16_t i = 0; i < size - 1U; ++i) {
      parser.byte(bytes[i], i);
    }
    CHECK(parser.byte(wrong, 9) == UbxEvent::kError);
    // From the second sync byte on: a message only where the wrong byte was the first.
    size = put(0);
    bool told = false;
    for (uint16_t i = 1; i < size; ++i) {
      told = parser.byte(bytes[i], 20) == UbxEvent::kMessage;
    }
    CHECK_EQ(told, wrong == 0xB5);
  }
}
