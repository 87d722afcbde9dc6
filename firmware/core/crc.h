// CRC-32 of zlib and CRC-16/CCITT-FALSE, byte by byte.
#pragma once

#include <stdint.h>

#include "core/progmem.h"

namespace core {

// What each byte of an index adds, byte by byte of the sum: on the AVR the page is the upper byte
// of a pointer and the index the lower, so that no address is computed.
struct CrcPages {
  uint8_t crc32[4][256];  // lowest byte first
  uint8_t crc16[2][256];  // upper byte first
};
extern const CrcPages kCrcPages;  // in program memory, at a page

// "123456789" gives 0xCBF43926.
class Crc32 {
 public:
  void add(const void* data, uint16_t size);
  uint32_t value() const { return ~state_; }
  // For whoever adds bytes while he hands them on.
  uint32_t state() const { return state_; }
  void set_state(uint32_t state) { state_ = state; }

 private:
  uint32_t state_ = 0xFFFFFFFFUL;
};

constexpr uint16_t kCrc16Start = 0xFFFF;      // CCITT-FALSE: "123456789" gives 0x29B1
constexpr uint16_t kCrc16StartCard = 0x0000;  // data blocks of an SD card: 0x31C3

// A table, because avr-gcc 5.4 makes loops of the shifts of the shorter form: 72 cycles a byte.
inline uint16_t crc16_add(uint16_t crc, uint8_t byte) {
  const uint8_t index = static_cast<uint8_t>((crc >> 8) ^ byte);
  const uint8_t upper =
      static_cast<uint8_t>(flash_u8(&kCrcPages.crc16[0][index]) ^ static_cast<uint8_t>(crc));
  return static_cast<uint16_t>(upper << 8 | flash_u8(&kCrcPages.crc16[1][index]));
}

uint16_t crc16(uint16_t start, const void* data, uint16_t size);

}  // namespace core
