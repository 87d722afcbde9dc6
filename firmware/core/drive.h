// Who drives the servos. The receiver does unless everything speaks for the Mega: self-test
// passed, all five channels steady, the switch seen at direct and then moved to Mega. Nothing
// here invents a position: an output repeats its own channel's last accepted width or is silent.
#pragma once

#include <stdint.h>

#include "core/rc_decoder.h"
#include "generated/frames.h"

namespace core {

constexpr uint8_t kAileron = 0;
constexpr uint8_t kElevator = 1;
constexpr uint8_t kRudder = 2;
constexpr uint8_t kThrottle = 3;
constexpr uint8_t kSwitch = 4;
constexpr uint8_t kChannels = 5;
constexpr uint8_t kServos = 4;  // the first four

// Receivers without signal may send steady preset pulses. A pilot who sets the failsafe of the
// switch channel below this width lets the Mega know.
constexpr uint16_t kFailsafeSwitchMaxUs = 950;

// By channel, not by receiver input.
struct RcChannels {
  uint16_t width_ticks[kChannels];  // 0: none accepted within 60 ms
  uint8_t fresh;                    // bit per channel
  uint8_t steady;                   // bit per channel
};

void map_channels(const RcDecoder& decoder, const frames::ConfigFrame& config, RcChannels& rc);

class DriveControl {
 public:
  static constexpr uint32_t kSwitchSettleUs = 100000;  // at direct, and then at Mega, this long

  void update(const RcChannels& rc,
              const frames::ConfigFrame& config,
              bool self_test_passed,
              uint32_t now_us);

  // The relay does not follow the heartbeat: to the receiver, until the switch sequence is seen
  // anew.
  void relay_lost() { release(frames::Drive::kDirectRelay); }

  frames::Drive drive() const { return drive_; }
  bool relay() const {
    return drive_ == frames::Drive::kMega || drive_ == frames::Drive::kMegaHolding;
  }
  uint16_t servo_ticks(uint8_t servo) const { return servo_ticks_[servo]; }  // 0: no pulse
  uint8_t missing() const { return missing_; }  // bit per channel, for the event receiver_lost

 private:
  enum class Switch : uint8_t { kMissing, kFailsafe, kDirect, kBetween, kMega };

  static Switch read_switch(const RcChannels& rc, const frames::ConfigFrame& config);
  void keep_or_release(const RcChannels& rc,
                       const frames::ConfigFrame& config,
                       bool self_test_passed,
                       uint32_t now_us);
  void engage_or_explain(const RcChannels& rc, bool self_test_passed, uint32_t now_us);
  void release(frames::Drive why);

  uint32_t since_us_ = 0;  // the switch came where it is
  uint32_t hold_us_ = 0;   // the hold began
  uint16_t servo_ticks_[kServos] = {};
  frames::Drive drive_ = frames::Drive::kDirectBoot;
  Switch switch_ = Switch::kMissing;
  uint8_t missing_ = (1U << kChannels) - 1;
  bool seen_direct_ = false;
  bool heard_ = false;  // all channels were steady once
};

}  // namespace core
