#include "core/float32.h"

#include "core/bytes.h"

namespace core {

bool float32_to_int(const uint8_t* bytes, uint32_t scale, int32_t limit, int32_t& out) {
  const uint32_t bits = get_le<uint32_t>(bytes);
  const uint8_t exponent = static_cast<uint8_t>(bits >> 23);
  if (exponent == 0xFF) {
    return false;
  }
  if (exponent == 0) {
    out = 0;  // zero, or smaller than any step that is asked for
    return true;
  }
  // mantissa * 2^(exponent - 150); 24 bits times a scale of at most 24 bits.
  uint64_t value = static_cast<uint64_t>((bits & 0x7FFFFFUL) | 0x800000UL) * scale;
  if (exponent >= 150) {
    const uint8_t up = static_cast<uint8_t>(exponent - 150);
    if (up > 15) {
      return false;
    }
    value <<= up;
  } else {
    const uint8_t down = static_cast<uint8_t>(150 - exponent);
    value = down > 62 ? 0 : (value + (uint64_t{1} << (down - 1))) >> down;
  }
  if (value > static_cast<uint32_t>(limit)) {
    return false;
  }
  const int32_t magnitude = static_cast<int32_t>(value);
  out = (bits >> 31) != 0 ? -magnitude : magnitude;
  return true;
}

}  // namespace core
