#include "core/crc.h"

namespace core {
namespace {

constexpr CrcPages make_pages() {
  CrcPages pages = {};
  for (uint16_t i = 0; i < 256; ++i) {
    uint32_t reflected = i;
    uint16_t plain = static_cast<uint16_t>(i << 8);
    for (uint8_t bit = 0; bit < 8; ++bit) {
      reflected = (reflected & 1) != 0 ? (reflected >> 1) ^ 0xEDB88320UL : reflected >> 1;
      plain = static_cast<uint16_t>((plain & 0x8000U) != 0 ? (plain << 1) ^ 0x1021U : plain << 1);
    }
    for (uint8_t byte = 0; byte < 4; ++byte) {
      pages.crc32[byte][i] = static_cast<uint8_t>(reflected >> (8 * byte));
    }
    pages.crc16[0][i] = static_cast<uint8_t>(plain >> 8);
    pages.crc16[1][i] = static_cast<uint8_t>(plain);
  }
  return pages;
}

}  // namespace

// 1.5 KB of flash; tables of nibbles would save 1.4 KB and double the time.
constexpr CrcPages kCrcPages CORE_FLASH __attribute__((aligned(256))) = make_pages();

void Crc32::add(const void* data, uint16_t size) {
  const uint8_t* bytes = static_cast<const uint8_t*>(data);
  uint32_t state = state_;
  while (size-- != 0) {
    const uint8_t index = static_cast<uint8_t>(state ^ *bytes++);
    const uint32_t added = static_cast<uint32_t>(flash_u8(&kCrcPages.crc32[3][index])) << 24 |
                           static_cast<uint32_t>(flash_u8(&kCrcPages.crc32[2][index])) << 16 |
                           static_cast<uint32_t>(flash_u8(&kCrcPages.crc32[1][index])) << 8 |
                           flash_u8(&kCrcPages.crc32[0][index]);
    state = added ^ (state >> 8);
  }
  state_ = state;
}

uint16_t crc16(uint16_t start, const void* data, uint16_t size) {
  const uint8_t* bytes = static_cast<const uint8_t*>(data);
  uint16_t crc = start;
#ifdef __AVR__
  // 17 cycles a byte, the compiler's way 28: each packet of the IMU comes through here.
  if (size == 0) {
    return crc;
  }
  __asm__ __volatile__(
      "1: ld r30, X+ \n\t"
      "eor r30, %B[crc] \n\t"
      "ldi r31, hi8(%[page]) \n\t"
      "lpm %B[crc], Z \n\t"
      "eor %B[crc], %A[crc] \n\t"
      "inc r31 \n\t"
      "lpm %A[crc], Z \n\t"
      "sbiw %[size], 1 \n\t"
      "brne 1b \n\t"
      : [crc] "+r"(crc), [bytes] "+x"(bytes), [size] "+w"(size)
      : [page] "i"(&kCrcPages.crc16)
      : "r30", "r31", "memory");
#else
  while (size-- != 0) {
    crc = crc16_add(crc, *bytes++);
  }
#endif
  return crc;
}

}  // namespace core
