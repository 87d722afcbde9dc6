// A slow task of the main loop: due once per period, late turns are left out, not made up for.
#pragma once

#include <stdint.h>

namespace core {

class Every {
 public:
  void start(uint32_t now_us) { next_us_ = now_us; }

  bool due(uint32_t now_us, uint32_t period_us) {
    const int32_t late_us = static_cast<int32_t>(now_us - next_us_);
    if (late_us < 0) {
      return false;
    }
    next_us_ += period_us;
    if (static_cast<uint32_t>(late_us) >= period_us) {
      next_us_ = now_us + period_us;
    }
    return true;
  }

 private:
  uint32_t next_us_ = 0;
};

}  // namespace core
