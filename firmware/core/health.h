// Proof of life: one heartbeat edge and one watchdog feed, at most every half millisecond, only
// after every task has reported that it ran. What a task found out (a dead card, a silent IMU) is
// not asked here. With a whole millisecond, two turns of 0.9 ms before one of 2.7 ms left a rest of
// 3.8 ms.
#pragma once

#include <stdint.h>

namespace core {

class HealthGate {
 public:
  static constexpr uint16_t kEdgeUs = 500;

  explicit constexpr HealthGate(uint8_t tasks)
      : required_(static_cast<uint8_t>((1U << tasks) - 1)) {}

  void ran(uint8_t task) { reported_ = static_cast<uint8_t>(reported_ | (1U << task)); }
  // True: toggle the heartbeat, feed the watchdog.
  bool beat(uint32_t now_us) {
    if ((reported_ & required_) != required_ || now_us - last_us_ < kEdgeUs) {
      return false;
    }
    last_us_ = now_us;
    reported_ = 0;
    return true;
  }

 private:
  const uint8_t required_;
  uint8_t reported_ = 0;
  uint32_t last_us_ = 0;
};

}  // namespace core
