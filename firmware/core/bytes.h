// Numbers from and to bytes, at any alignment.
#pragma once

#include <stdint.h>
#include <string.h>

namespace core {

// Every machine this runs on is little-endian, as the wire is.
static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the wire is little-endian");

template <typename T>
T get_le(const uint8_t* from) {
  T value;
  memcpy(&value, from, sizeof(T));
  return value;
}

template <typename T>
void put_le(uint8_t* to, T value) {
  memcpy(to, &value, sizeof(T));
}

inline uint16_t get_be16(const uint8_t* from) {
  return static_cast<uint16_t>(static_cast<uint16_t>(from[0]) << 8 | from[1]);
}

inline uint32_t get_be24(const uint8_t* from) {
  return static_cast<uint32_t>(from[0]) << 16 | get_be16(from + 1);
}

}  // namespace core
