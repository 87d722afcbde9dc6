#include <string.h>

#include "check.h"
#include "core/crc.h"

namespace {

const char kDigits[] = "123456789";

// The definition, one bit at a time.
uint32_t slow_crc32(const uint8_t* data, uint16_t size) {
  uint32_t crc = 0xFFFFFFFFU;
  for (uint16_t i = 0; i < size; ++i) {
    crc ^= data[i];
    for (uint8_t bit = 0; bit < 8; ++bit) {
      crc = (crc & 1) != 0 ? (crc >> 1) ^ 0xEDB88320U : crc >> 1;
    }
  }
  return ~crc;
}

uint16_t slow_crc16(uint16_t crc, const uint8_t* data, uint16_t size) {
  for (uint16_t i = 0; i < size; ++i) {
    crc = static_cast<uint16_t>(crc ^ (static_cast<uint16_t>(data[i]) << 8));
    for (uint8_t bit = 0; bit < 8; ++bit) {
      crc = static_cast<uint16_t>((crc & 0x8000U) != 0 ? (crc << 1) ^ 0x1021U : crc << 1);
    }
  }
  return crc;
}

}  // namespace

TEST_CASE("the check values of both CRCs") {
  core::Crc32 crc;
  crc.add(kDigits, 9);
  CHECK(crc.value() == 0xCBF43926U);
  CHECK(core::crc16(core::kCrc16Start, kDigits, 9) == 0x29B1U);
  CHECK(core::crc16(core::kCrc16StartCard, kDigits, 9) == 0x31C3U);
}

TEST_CASE("nothing added") {
  core::Crc32 crc;
  CHECK(crc.value() == 0U);
  CHECK(core::crc16(core::kCrc16Start, kDigits, 0) == 0xFFFFU);
}

TEST_CASE("every byte value, in pieces, against the definition") {
  uint8_t data[256];
  for (uint16_t i = 0; i < sizeof(data); ++i) {
    data[i] = static_cast<uint8_t>(i * 7U + 3U);
  }
  core::Crc32 crc;
  crc.add(data, 1);
  crc.add(data + 1, 100);
  crc.add(data + 101, 155);
  CHECK(crc.value() == slow_crc32(data, 256));
  CHECK(core::crc16(core::kCrc16Start, data, 256) == slow_crc16(0xFFFF, data, 256));
}

TEST_CASE("a block with its CRC-16 behind it leaves zero, as the card driver checks") {
  uint8_t data[11];
  memcpy(data, kDigits, 9);
  const uint16_t crc = core::crc16(core::kCrc16StartCard, data, 9);
  data[9] = static_cast<uint8_t>(crc >> 8);
  data[10] = static_cast<uint8_t>(crc);
  CHECK(core::crc16(core::kCrc16StartCard, data, 11) == 0U);
}
