#include "core/ident_trigger.h"

namespace core {
namespace {

constexpr uint16_t kLateUs = 1000;
// The loop wakes each millisecond where nothing else does. A frame that it has just missed is due
// half of one later from then on, or one in some would be missed and the next not.
constexpr uint16_t kMissedUs = 850;
constexpr uint16_t kApartUs = 500;
constexpr uint16_t kTransferUs = 1100;  // START to STOP of a packet at 400 kHz

void count(uint16_t& counter) {
  if (counter != 0xFFFF) {
    ++counter;
  }
}

}  // namespace

void IdentTrigger::start(uint16_t rate_hz, uint32_t now_us) {
  period_us_ = 1000000U / rate_hz;
  last_us_ = now_us;
  imu_leads_ = false;
  packet_waits_ = false;
  measure_mask();
}

void IdentTrigger::imu_packet(uint8_t seq, uint32_t start_us, bool started) {
  const uint32_t since_us = start_us - last_packet_us_;
  if (seq == static_cast<uint8_t>(last_seq_ + 1) && since_us >= 1000 && since_us <= 30000) {
    const int16_t change_us = static_cast<int16_t>(static_cast<int16_t>(since_us) -
                                                   static_cast<int16_t>(packet_period_us_));
    packet_period_us_ = static_cast<uint16_t>(packet_period_us_ + change_us / 8);
  }
  last_packet_us_ = start_us;
  last_seq_ = seq;
  if ((seq & 7U) == 0) {
    measure_mask();
  }
  packet_waits_ = !started;
  if (started) {
    lead(start_us);
  }
}

void IdentTrigger::lead(uint32_t start_us) {
  imu_leads_ = true;
  last_imu_us_ = start_us;
  last_us_ = start_us;
}

bool IdentTrigger::bad_packet(uint32_t start_us) {
  if (start_us - last_us_ + packet_period_us_ / 2 < period_us_) {
    return false;  // its number was wrong too
  }
  lead(start_us);
  return true;
}

// A lower rate takes every 2nd, 4th or 8th sample: always those whose number divides, so that two
// recorders of one flight, or one after a reset, keep the same samples.
void IdentTrigger::measure_mask() {
  const uint16_t half_us = packet_period_us_ / 2;
  uint8_t mask = 0;
  for (uint8_t every = 2; every <= 8; every = static_cast<uint8_t>(every << 1)) {
    if (period_us_ + half_us >= static_cast<uint32_t>(packet_period_us_) * every) {
      mask = static_cast<uint8_t>(every - 1);
    }
  }
  mask_ = mask;
}

IdentTrigger::Source IdentTrigger::poll(uint32_t now_us, bool ready) {
  if (packet_waits_) {
    const uint32_t since_us = last_packet_us_ - last_imu_us_;
    // At 200 Hz a scan ends 0.4 ms before the next packet: one begun late makes that packet wait.
    if (!ready && now_us - last_packet_us_ < period_us_) {
      return Source::kNone;
    }
    packet_waits_ = false;
    if ((last_seq_ & mask_) == 0 &&
        (!imu_leads_ || since_us + packet_period_us_ / 2 >= period_us_)) {
      // Even a packet left out sets the phase: the timer stays 1.5 periods behind it, else both
      // would go on meeting each other's unfinished frames at 200 Hz.
      lead(last_packet_us_);
      if (!ready) {
        count(overruns_);
        return Source::kNone;
      }
      if (now_us - last_packet_us_ > kTransferUs + kLateUs) {
        count(late_);
      }
      return Source::kImu;
    }
  }
  const uint32_t wait_us = imu_leads_ ? period_us_ + period_us_ / 2 : period_us_;
  const uint32_t since_us = now_us - last_us_;
  if (static_cast<int32_t>(since_us) < 0 || since_us < wait_us) {
    return Source::kNone;
  }
  // Behind the scan of a bad packet that made no frame.
  if (!ready && since_us - wait_us < period_us_) {
    return Source::kNone;
  }
  imu_leads_ = false;
  last_us_ += wait_us;
  const uint32_t behind_us = since_us - wait_us;
  if (behind_us >= kMissedUs && behind_us < kLateUs) last_us_ += kApartUs;
  if (now_us - last_us_ >= period_us_) {
    last_us_ = now_us;
  }
  if (!ready) {
    count(overruns_);
    return Source::kNone;
  }
  if (since_us - wait_us > kLateUs) {
    count(late_);
  }
  return Source::kTimer;
}

}  // namespace core
