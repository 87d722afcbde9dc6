// When an identification frame is made: at an IMU packet of the new kind (every n-th at a lower
// rate), or 1.5 periods after the last trigger by the timer, then every period until packets
// return. Main loop only.
#pragma once

#include <stdint.h>

namespace core {

class IdentTrigger {
 public:
  enum class Source : uint8_t { kNone, kImu, kTimer };

  void start(uint16_t rate_hz, uint32_t now_us);
  // A good packet of the new kind; `arrived_us` as the interrupt stamped it.
  void imu_packet(uint8_t seq, uint32_t arrived_us);
  // `ready`: the last frame is finished (its analogue scan takes 4.6 ms). A packet that meets
  // an unfinished frame waits for a period at most; then, as the timer at once, it is left out and
  // counted.
  Source poll(uint32_t now_us, bool ready);

  uint16_t late() const { return late_; }          // served more than 1 ms after they were due
  uint16_t overruns() const { return overruns_; }  // left out
  uint32_t period_us() const { return period_us_; }

 private:
  bool in_phase() const;

  uint32_t period_us_ = 10000;
  uint32_t last_us_ = 0;         // last trigger
  uint32_t last_packet_us_ = 0;  // last packet, for the measured packet period
  uint32_t last_imu_us_ = 0;     // last packet that triggered
  uint16_t packet_period_us_ = 5000;
  uint16_t late_ = 0;
  uint16_t overruns_ = 0;
  uint8_t last_seq_ = 0;
  bool packet_waits_ = false;
  bool imu_leads_ = false;  // the last trigger was a packet
};

}  // namespace core
