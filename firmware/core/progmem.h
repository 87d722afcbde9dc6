// Tables in program memory: on the AVR a const table would otherwise stand in RAM.
// Reads with LPM, so below 64 KB; the linker puts such tables first in flash.
#pragma once

#include <stdint.h>
#include <string.h>

#ifdef __AVR__
#define CORE_FLASH __attribute__((__progmem__))
#else
#define CORE_FLASH
#endif

namespace core {

inline uint8_t flash_u8(const void* at) {
#ifdef __AVR__
  uint8_t value;
  __asm__("lpm %0, Z" : "=r"(value) : "z"(at));
  return value;
#else
  return *static_cast<const uint8_t*>(at);
#endif
}

inline uint16_t flash_u16(const void* at) {
#ifdef __AVR__
  uint16_t value;
  __asm__("lpm %A0, Z+\n\tlpm %B0, Z" : "=r"(value), "+z"(at));
  return value;
#else
  uint16_t value;
  memcpy(&value, at, sizeof(value));
  return value;
#endif
}

inline void flash_copy(void* to, const void* from, uint16_t size) {
  uint8_t* out = static_cast<uint8_t*>(to);
  const uint8_t* in = static_cast<const uint8_t*>(from);
  while (size-- != 0) {
    *out++ = flash_u8(in++);
  }
}

// The value of any table entry: `load(&kTable[i])`.
template <typename T>
T flash_load(const T* from) {
  T value;
  flash_copy(&value, from, sizeof(T));
  return value;
}

}  // namespace core
