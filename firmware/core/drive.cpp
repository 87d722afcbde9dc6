#include "core/drive.h"

#include "core/progmem.h"

namespace core {
namespace {

// A shift by a variable is a loop on the AVR: bits come from here, or go along with a loop.
constexpr uint8_t kBitOf[kRcInputs] CORE_FLASH = {1, 2, 4, 8, 16};

constexpr uint8_t kAllChannels = (1U << kChannels) - 1;
constexpr uint8_t kServoChannels = (1U << kServos) - 1;
constexpr uint8_t kSwitchBit = 1U << kSwitch;

uint16_t to_ticks(uint16_t width_us) {
  return static_cast<uint16_t>(width_us * kTicksPerUs);
}

}  // namespace

// Where it stands, as it is asked for with every pulse: a result of its own was 0.3 % of the chip.
void map_channels(const RcDecoder& decoder, const frames::ConfigFrame& config, RcChannels& rc) {
  using frames::ConfigFrame;
  static_assert(
      offsetof(ConfigFrame, input_switch) == offsetof(ConfigFrame, input_aileron) + kChannels - 1,
      "the inputs stand in the order of the channels");
  const uint8_t* next =
      reinterpret_cast<const uint8_t*>(&config) + offsetof(ConfigFrame, input_aileron);
  rc.fresh = 0;
  rc.steady = 0;
  uint8_t bit = 1;
  for (uint8_t channel = 0; channel < kChannels; ++channel, bit = static_cast<uint8_t>(bit << 1)) {
    const uint8_t input = *next++;
    if (input >= kRcInputs) {
      rc.width_ticks[channel] = 0;
      continue;
    }
    const uint8_t input_bit = flash_u8(&kBitOf[input]);
    rc.width_ticks[channel] = decoder.width_ticks(input);
    if ((decoder.fresh() & input_bit) != 0) {
      rc.fresh = static_cast<uint8_t>(rc.fresh | bit);
    }
    if ((decoder.steady() & input_bit) != 0) {
      rc.steady = static_cast<uint8_t>(rc.steady | bit);
    }
  }
}

DriveControl::Switch DriveControl::read_switch(const RcChannels& rc,
                                               const frames::ConfigFrame& config) {
  const uint16_t width_ticks = rc.width_ticks[kSwitch];
  if (width_ticks == 0) {
    return Switch::kMissing;
  }
  if (width_ticks < to_ticks(kFailsafeSwitchMaxUs)) {
    return Switch::kFailsafe;
  }
  if (width_ticks <= to_ticks(config.switch_direct_max_us)) {
    return Switch::kDirect;
  }
  return width_ticks >= to_ticks(config.switch_mega_min_us) ? Switch::kMega : Switch::kBetween;
}

void DriveControl::update(const RcChannels& rc,
                          const frames::ConfigFrame& config,
                          bool self_test_passed,
                          uint32_t now_us) {
  const Switch at = read_switch(rc, config);
  if (at != switch_) {
    switch_ = at;
    since_us_ = now_us;
  }
  uint8_t missing = 0;
  uint8_t bit = 1;
  for (uint8_t channel = 0; channel < kChannels; ++channel, bit = static_cast<uint8_t>(bit << 1)) {
    if (rc.width_ticks[channel] == 0) {
      missing = static_cast<uint8_t>(missing | bit);
    }
  }
  missing_ = missing;
  if (relay()) {
    keep_or_release(rc, config, self_test_passed, now_us);
  } else {
    engage_or_explain(rc, self_test_passed, now_us);
  }
  bit = 1;
  for (uint8_t servo = 0; servo < kServos; ++servo, bit = static_cast<uint8_t>(bit << 1)) {
    if ((rc.steady & bit) != 0) {
      servo_ticks_[servo] = rc.width_ticks[servo];
    } else if (drive_ != frames::Drive::kMegaHolding || servo == kThrottle) {
      servo_ticks_[servo] = 0;
    }
  }
}

void DriveControl::keep_or_release(const RcChannels& rc,
                                   const frames::ConfigFrame& config,
                                   bool self_test_passed,
                                   uint32_t now_us) {
  if (!self_test_passed) {
    release(frames::Drive::kDirectSelfTest);
    return;
  }
  switch (switch_) {
    case Switch::kFailsafe:
      release(frames::Drive::kDirectReceiverLost);
      return;
    case Switch::kDirect:
    case Switch::kBetween:
      release(frames::Drive::kDirectSwitch);
      return;
    case Switch::kMissing:
      // Others still arrive: only the switch is lost. Nothing arrives: the receiver is, and the
      // switch was merely first in its frame.
      if ((rc.fresh & kServoChannels) != 0) {
        release(frames::Drive::kDirectSwitchInvalid);
        return;
      }
      break;
    case Switch::kMega:
      if (rc.steady == kAllChannels) {
        drive_ = frames::Drive::kMega;
        return;
      }
      break;
  }
  if (config.hold_ms == 0) {
    release(frames::Drive::kDirectReceiverLost);
  } else if (drive_ != frames::Drive::kMegaHolding) {
    drive_ = frames::Drive::kMegaHolding;
    hold_us_ = now_us;
  } else if (now_us - hold_us_ >= static_cast<uint32_t>(config.hold_ms) * 1000) {
    release(frames::Drive::kDirectReceiverLost);
  }
}

void DriveControl::engage_or_explain(const RcChannels& rc, bool self_test_passed, uint32_t now_us) {
  const bool receiver = rc.steady == kAllChannels && switch_ != Switch::kFailsafe;
  if (!receiver || !self_test_passed) {
    seen_direct_ = false;
    if (!self_test_passed) {
      drive_ = frames::Drive::kDirectSelfTest;
    } else if (!heard_) {
      drive_ = frames::Drive::kDirectBoot;
    } else if ((rc.steady & kServoChannels) == kServoChannels && (rc.steady & kSwitchBit) == 0) {
      drive_ = frames::Drive::kDirectSwitchInvalid;
    } else {
      drive_ = frames::Drive::kDirectReceiverLost;
    }
    return;
  }
  heard_ = true;
  // What released the relay stays said until the pilot switches to direct.
  if (drive_ != frames::Drive::kDirectRelay || switch_ == Switch::kDirect) {
    drive_ = frames::Drive::kDirectSwitch;
  }
  if (now_us - since_us_ < kSwitchSettleUs) {
    return;
  }
  if (switch_ == Switch::kDirect) {
    seen_direct_ = true;
  } else if (switch_ == Switch::kMega && seen_direct_) {
    drive_ = frames::Drive::kMega;
  }
}

void DriveControl::release(frames::Drive why) {
  drive_ = why;
  seen_direct_ = false;
}

}  // namespace core
