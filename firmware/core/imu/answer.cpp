#include "core/imu/answer.h"

#include "core/progmem.h"

namespace core {
namespace {

const char kImage[] CORE_FLASH = "imu image ";
const char kShow[] CORE_FLASH = "imu";
const char kBlank[] CORE_FLASH = " ";
const char kEnd[] CORE_FLASH = "\r\n";
const char kKept[] CORE_FLASH = "imu: kept\r\n";
const char kMoving[] CORE_FLASH = "imu: not at rest, nothing changed\r\n";
const char kUnknown[] CORE_FLASH = "imu: zero level show declination iron dlpf compat\r\n";

void put_number(TextLine& out, int16_t value) {
  out.flash(kBlank);
  out.number(value);
}

// Offsets p q r ax ay az, declination, DLPF_CFG, compat, whether the offsets count.
void put_settings(TextLine& out, const ImuSettings& settings) {
  out.flash(kShow);
  for (uint8_t axis = 0; axis < 3; ++axis) {
    put_number(out, settings.rate_offset[axis]);
  }
  for (uint8_t axis = 0; axis < 3; ++axis) {
    put_number(out, settings.force_offset[axis]);
  }
  put_number(out, settings.declination_cdeg);
  put_number(out, settings.dlpf);
  put_number(out, settings.compat);
  put_number(out, settings.offsets_valid);
  out.flash(kEnd);
}

}  // namespace

void TextLine::letter(char value) {
  if (size_ < kLongest) {
    bytes_[size_++] = static_cast<uint8_t>(value);
  }
}

void TextLine::flash(const char* text) {
  for (;; ++text) {
    const char next = static_cast<char>(flash_u8(text));
    if (next == '\0') {
      return;
    }
    letter(next);
  }
}

void TextLine::number(int16_t value) {
  char digits[5];
  uint8_t count = 0;
  uint16_t left = value < 0 ? static_cast<uint16_t>(0U - static_cast<uint16_t>(value))
                            : static_cast<uint16_t>(value);
  do {
    digits[count++] = static_cast<char>('0' + left % 10U);
    left = static_cast<uint16_t>(left / 10U);
  } while (left != 0);
  if (value < 0) {
    letter('-');
  }
  while (count != 0) {
    letter(digits[--count]);
  }
}

void TextLine::hex(uint32_t value) {
  for (uint8_t digit = 0; digit < 8; ++digit) {
    const uint8_t next = static_cast<uint8_t>(value >> 28);
    letter(static_cast<char>(next < 10 ? '0' + next : 'a' + next - 10));
    value <<= 4;
  }
}

void put_image(TextLine& out, uint32_t image_hash) {
  out.flash(kImage);
  out.hex(image_hash);
  out.flash(kEnd);
}

void put_answer(TextLine& out, ImuReply reply, const ImuSettings& settings) {
  switch (reply) {
    case ImuReply::kNone:
      break;
    case ImuReply::kShow:
      put_settings(out, settings);
      break;
    case ImuReply::kChanged:
      out.flash(kKept);
      break;
    case ImuReply::kMoving:
      out.flash(kMoving);
      break;
    case ImuReply::kUnknown:
      out.flash(kUnknown);
      break;
  }
}

}  // namespace core
