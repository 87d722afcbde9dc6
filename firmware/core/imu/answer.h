// What the IMU prints on its serial header: which image runs, its settings, what became of a
// command.
#pragma once

#include <stdint.h>

#include "core/imu/console.h"
#include "core/imu/record.h"

namespace core {

// A line of text with its end, no longer than the port takes at once.
class TextLine {
 public:
  static constexpr uint8_t kLongest = 63;

  // What does not fit is left out.
  void flash(const char* text);  // lies in program memory
  void number(int16_t value);
  void hex(uint32_t value);  // eight digits

  const uint8_t* bytes() const { return bytes_; }
  uint8_t size() const { return size_; }

 private:
  void letter(char value);

  uint8_t bytes_[kLongest] = {};
  uint8_t size_ = 0;
};

void put_image(TextLine& out, uint32_t image_hash);
// Empty for a line that is none of ours.
void put_answer(TextLine& out, ImuReply reply, const ImuSettings& settings);

}  // namespace core
