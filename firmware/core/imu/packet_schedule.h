// When the packet of a sample leaves: 3.0 ms behind its data-ready, whatever the attitude took, so
// that packets come as evenly as samples.
#pragma once

#include <stdint.h>

namespace core {

class PacketSchedule {
 public:
  // What happens between data-ready and the seal takes 2 ms, 2.7 ms when it has to wait for the
  // magnetometer.
  static constexpr uint16_t kStartUs = 3000;
  static constexpr uint16_t kSealUs = 260;  // from the seal to START: put_packet takes 240 us

  void sampled(uint32_t sample_us) {
    start_us_ = sample_us + kStartUs;
    waits_ = true;
  }
  // Between a sample and the seal of its packet: the processor is kept free.
  bool waits() const { return waits_; }
  // When the main loop has to look again.
  uint32_t wake_us() const { return start_us_ - kSealUs; }

  // True once for each sample: its packet is to be sealed now, because its time has come or has
  // passed.
  bool due(uint32_t now_us) {
    if (!waits_ || static_cast<int32_t>(now_us - wake_us()) < 0) {
      return false;
    }
    waits_ = false;
    return true;
  }

  // The START of a packet sealed from `now_us` on: the planned one, or the soonest possible.
  uint32_t start_us(uint32_t now_us) const {
    const uint32_t soonest_us = now_us + kSealUs;
    return static_cast<int32_t>(soonest_us - start_us_) > 0 ? soonest_us : start_us_;
  }

 private:
  uint32_t start_us_ = 0;
  bool waits_ = false;
};

}  // namespace core
