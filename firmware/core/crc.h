// CRC-32 of zlib and CRC-16/CCITT-FALSE, byte by byte.
#pragma once

#include <stdint.h>

#include "core/progmem.h"

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

struct Crc16Table {
  uint16_t entry[256];
};
extern const Crc16Table kCrc16Table;  // in program memory

// A table, because avr-gcc 5.4 makes loops of the shifts of the shorter form: 72 cycles a byte.
inline uint16_t crc16_add(uint16_t crc, uint8_t byte) {
  const uint8_t index = static_cast<uint8_t>((crc >> 8) ^ byte);
  return static_cast<uint16_t>(static_cast<uint16_t>(crc << 8) ^
                               flash_u16(&kCrc16Table.entry[index]));
}

uint16_t crc16(uint16_t start, const void* data, uint16_t size);

}  // namespace core
