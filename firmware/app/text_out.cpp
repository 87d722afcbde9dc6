#include "app/text_out.h"

#include "core/progmem.h"

namespace app {

void TextOut::flash(const char* flash) {
  for (;; ++flash) {
    const char next = static_cast<char>(core::flash_u8(flash));
    if (next == '\0') return;
    letter(next);
  }
}

void TextOut::number(int32_t value) {
  fixed(value, 0);
}

void TextOut::fixed(int32_t value, uint8_t places) {
  char digits[12];
  uint8_t count = 0;
  uint32_t left = value < 0 ? 0U - static_cast<uint32_t>(value) : static_cast<uint32_t>(value);
  do {
    digits[count++] = static_cast<char>('0' + left % 10U);
    left /= 10U;
  } while (left > 0 || count <= places);
  if (value < 0) letter('-');
  while (count > 0) {
    letter(digits[--count]);
    if (count == places && places > 0) letter('.');
  }
}

void TextOut::hex(uint32_t value) {
  for (uint8_t digit = 0; digit < 8; ++digit) {
    const uint8_t next = static_cast<uint8_t>(value >> 28);
    letter(static_cast<char>(next < 10 ? '0' + next : 'a' + next - 10));
    value <<= 4;
  }
}

}  // namespace app
