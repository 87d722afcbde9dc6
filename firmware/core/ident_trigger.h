// When an identification frame is made: at an IMU packet of the new kind (every n-th at a lower
// rate), or 1.5 periods after the last trigger by the timer, then every period until packets
// return. Main loop only, but for `starts_scan`.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "generated/frames.h"

namespace core {

// Asked by the board at a packet's STOP, in its interrupt: does the packet start the analogue scan
// at once? `mask` as IdentTrigger::mask() gives it. Its CRC is looked at later, by the main loop.
inline bool starts_scan(uint8_t address, uint8_t length, const uint8_t* bytes, uint8_t mask) {
  return address == frames::kImuPacketAddress && length == frames::kImuPacketSize &&
         bytes[0] == frames::kImuPacketKind &&
         (bytes[offsetof(frames::ImuPacket, seq)] & mask) == 0;
}

class IdentTrigger {
 public:
  enum class Source : uint8_t { kNone, kImu, kTimer };

  void start(uint16_t rate_hz, uint32_t now_us);
  // A good packet of the new kind; `start_us` is the instant of its START. `started`: it has
  // started a scan by itself, and a frame is made of it without asking `poll`.
  void imu_packet(uint8_t seq, uint32_t start_us, bool started);
  // A packet that turned out bad has started a scan. True: a frame is due, and is made of that scan
  // with the sample there is; else the scan is not used.
  bool bad_packet(uint32_t start_us);
  // Packets whose sequence number has none of these bits start a scan: every one, or every 2nd, 4th
  // or 8th at a lower rate.
  uint8_t mask() const { return mask_; }
  // `ready`: the last frame is finished (its analogue scan takes 4.6 ms). A packet in phase that
  // has started no scan, because one was under way, waits for a period at most, and so does the
  // timer; then it is left out and counted.
  Source poll(uint32_t now_us, bool ready);

  uint16_t late() const { return late_; }          // served more than 1 ms after STOP or timer
  uint16_t overruns() const { return overruns_; }  // left out
  uint32_t period_us() const { return period_us_; }

 private:
  void lead(uint32_t start_us);  // a packet triggers
  void measure_mask();

  uint32_t period_us_ = 10000;
  uint32_t last_us_ = 0;         // last trigger
  uint32_t last_packet_us_ = 0;  // last packet, for the measured packet period
  uint32_t last_imu_us_ = 0;     // last packet that triggered
  uint16_t packet_period_us_ = 5000;
  uint16_t late_ = 0;
  uint16_t overruns_ = 0;
  uint8_t last_seq_ = 0;
  uint8_t mask_ = 0;
  bool packet_waits_ = false;
  bool imu_leads_ = false;  // the last trigger was a packet
};

}  // namespace core
