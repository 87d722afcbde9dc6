// Whether the gyro and accelerometer are alive, and on which bus to look for them.
#pragma once

#include <stdint.h>

namespace core {

class SensorWatch {
 public:
  static constexpr uint32_t kSilentUs = 20000;      // four samples: the chip or its line is dead
  static constexpr uint32_t kOtherBusUs = 1000000;  // no chip by SPI: one by I2C, and back

  // Looks by SPI from now on.
  void start(uint32_t now_us) { tried_us_ = now_us; }

  // The chip samples now. From its first time on there is no reason to look at the other bus.
  void found(uint32_t now_us) {
    sample_us_ = now_us;
    found_ = true;
  }
  void sampled(uint32_t sample_us) { sample_us_ = sample_us; }
  // Asked of a chip that is set up; true: set it up again.
  bool silent(uint32_t now_us) const { return now_us - sample_us_ > kSilentUs; }

  // Asked while no chip answers; true once a second until one was found: try the other bus.
  bool other_bus_due(uint32_t now_us) {
    if (found_ || now_us - tried_us_ <= kOtherBusUs) {
      return false;
    }
    tried_us_ = now_us;
    return true;
  }

 private:
  uint32_t sample_us_ = 0;
  uint32_t tried_us_ = 0;
  bool found_ = false;
};

}  // namespace core
