// Lines from the IMU's serial header, for the ground: `imu zero`, `imu level`, `imu declination
// 413`, `imu iron 120 -45 30`, `imu dlpf 2`, `imu compat 1`, `imu show`. Everything but `show` is
// refused in motion.
#pragma once

#include <stdint.h>

#include "core/imu/node.h"

namespace core {

enum class ImuReply : uint8_t {
  kNone,     // no whole line yet, or one not for us
  kShow,     // the caller prints the settings
  kChanged,  // done: keep the settings
  kMoving,   // refused: not at rest
  kUnknown,  // no such command, or its number is out of range
};

class ImuConsole {
 public:
  ImuReply byte(uint8_t value, ImuNode& node, ImuSettings& settings);

 private:
  static constexpr uint8_t kLongest = 27;
  ImuReply line(ImuNode& node, ImuSettings& settings);

  char line_[kLongest + 1] = {};
  uint8_t size_ = 0;
  bool too_long_ = false;
};

}  // namespace core
