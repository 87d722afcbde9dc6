// CRC-32 of zlib and CRC-16/CCITT-FALSE, byte by byte.
#pragma once

#include <stdint.h>

namespace core {

// "123456789" gives 0xCBF43926.
class Crc32 {
 public:
  void add(const void* data, uint16_t size);
  uint32_t value() const { return ~state_; }

 private:
  uint32_t state_ = 0xFFFFFFFFUL;
};

constexpr uint16_t kCrc16Start = 0xFFFF;      // CCITT-FALSE: "123456789" gives 0x29B1
constexpr uint16_t kCrc16StartCard = 0x0000;  // data blocks of an SD card: 0x31C3

inline uint16_t crc16_add(uint16_t crc, uint8_t byte) {
  crc = static_cast<uint16_t>(static_cast<uint16_t>(crc << 8) | (crc >> 8));
  crc = static_cast<uint16_t>(crc ^ byte);
  crc = static_cast<uint16_t>(crc ^ (static_cast<uint8_t>(crc) >> 4));
  crc = static_cast<uint16_t>(crc ^ (crc << 12));
  return static_cast<uint16_t>(crc ^ (static_cast<uint16_t>(crc & 0xFF) << 5));
}

uint16_t crc16(uint16_t start, const void* data, uint16_t size);

}  // namespace core
