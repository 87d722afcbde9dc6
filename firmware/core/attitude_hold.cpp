#include "core/attitude_hold.h"

#include <string.h>

#include "core/input_command.h"

namespace core {
namespace {

using frames::InputEnd;

constexpr uint8_t kSumShift = 2;         // 20 errors of 6000 stay within 16 bits
constexpr uint16_t kMostStepUs = 15000;  // a sample that came late moves no further than this long

// An axis that is held turns on for 0.16 s: a servo's period of 20 ms, its own lag of 20 to 40 ms,
// and the time of the roll mode, 0.1 s. A raw step of a rate is a quarter of 0.01 deg in 0.164 s.
bool soon_beyond(int16_t angle, int16_t rate, int16_t most) {
  const int16_t there = static_cast<int16_t>(angle + (rate >> 2));
  return size_of(there) > static_cast<uint16_t>(most);
}

}  // namespace

void HeldAxis::load(const frames::CardHoldLayout& card, uint8_t axis) {
  angle_gain_ = card.angle_gain[axis];
  integral_gain_ = card.integral_gain[axis];
  rate_gain_ = card.rate_gain[axis];
  authority_ = static_cast<int16_t>(card.authority_us[axis] * kTicksPerUs);
}

void HeldAxis::start(int16_t angle) {
  wanted_angle_ = angle;
  integral_ = 0;
  error_ = 0;
  span_sum_ = 0;
  last_sum_ = 0;
  samples_ = 0;
  grown_ = 0;
  worked_ = true;
}

// All products are of 16 bits. In ticks / 2^14: error below 2^13, so a part is below 2^28, that of
// the rate at most 2^30, the integral's at most 2^24: their sum fits.
int16_t HeldAxis::demand(int16_t angle, int16_t rate) {
  error_ = static_cast<int16_t>(wanted_angle_ - angle);
  const int32_t sum = static_cast<int32_t>(angle_gain_) * error_ -
                      static_cast<int32_t>(rate_gain_) * rate + (integral_ >> 6);
  const int32_t most = static_cast<int32_t>(authority_) << 14;
  if (sum >= most) return authority_;
  if (sum <= -most) return static_cast<int16_t>(-authority_);
  // Frozen while the demand is beyond the authority.
  integral_ += static_cast<int32_t>(integral_gain_) * error_;
  const int32_t most_integral = static_cast<int32_t>(authority_) << 20;
  if (integral_ > most_integral) integral_ = most_integral;
  if (integral_ < -most_integral) integral_ = -most_integral;
  // Rounded; the sum is below 2^24 here.
  return static_cast<int16_t>(((sum + (1 << 13)) * 4) >> 16);
}

bool HeldAxis::loses(int16_t applied_ticks) {
  const bool against = (error_ < 0) == ((applied_ticks < 0) == (angle_gain_ > 0));
  if (!against || size_of(applied_ticks) < static_cast<uint16_t>(authority_) >> kWorksShift) {
    worked_ = false;
  }
  span_sum_ = static_cast<uint16_t>(span_sum_ + (size_of(error_) >> kSumShift));
  if (++samples_ < kSpanSamples) return false;
  grown_ = worked_ && span_sum_ > last_sum_ ? static_cast<uint8_t>(grown_ + 1U) : uint8_t{0};
  last_sum_ = span_sum_;
  span_sum_ = 0;
  samples_ = 0;
  worked_ = true;
  return grown_ >= kMostSpans;
}

void AttitudeHold::load(const frames::CardHoldLayout& card, uint8_t held, uint16_t rate_max_usps) {
  for (uint8_t axis = 0; axis < kHeldAxes; ++axis) axes_[axis].load(card, axis);
  rate_max_usps_ = rate_max_usps;
  held_ = held;
  alike_ = 0;
  // No stick is there: without arm() none was still.
  for (uint16_t& ticks : stick_ticks_) ticks = 0;
}

void AttitudeHold::arm(const RcChannels& rc) {
  for (uint8_t i = 0; i < kServos; ++i) stick_ticks_[i] = rc.width_ticks[i];
}

bool AttitudeHold::sticks_still(const RcChannels& rc, uint16_t stick_us) const {
  for (uint8_t i = 0; i < kServos; ++i) {
    if (apart(rc.width_ticks[i], stick_ticks_[i]) > stick_us * kTicksPerUs) return false;
  }
  return true;
}

bool AttitudeHold::still(const InputReadings& in) {
  if (memcmp(rates_, in.rates, sizeof rates_) != 0 ||
      memcmp(force_, in.force, sizeof force_) != 0) {
    memcpy(rates_, in.rates, sizeof rates_);
    memcpy(force_, in.force, sizeof force_);
    alike_ = 1;
    return false;
  }
  if (alike_ < kMostAlike) ++alike_;
  return alike_ >= kMostAlike;
}

InputEnd AttitudeHold::may_start(const InputReadings& in) {
  theta_ = in.theta;
  if (!in.imu) return InputEnd::kSensorLost;
  if (still(in)) return InputEnd::kSensorStill;
  const bool calm = size_of(in.phi) <= kStartBank && size_of(in.theta) <= kStartPitch &&
                    size_of(in.rates[0]) <= kStartRate && size_of(in.rates[1]) <= kStartRate &&
                    size_of(in.rates[2]) <= kStartRate;
  return calm ? InputEnd::kDone : InputEnd::kHoldAttitude;
}

void AttitudeHold::start(uint32_t now_us) {
  axes_[kAileron].start(0);
  axes_[kElevator].start(theta_);
  stepped_us_ = static_cast<uint16_t>(now_us);
}

InputEnd AttitudeHold::step(const InputReadings& in, int16_t* applied_ticks, uint32_t now_us) {
  if (!in.imu) return InputEnd::kSensorLost;
  if (still(in)) return InputEnd::kSensorStill;
  if (size_of(in.phi) > kMostBank) return InputEnd::kBank;
  if (size_of(in.theta) > kMostPitch) return InputEnd::kPitch;
  if (holds(kAileron) && soon_beyond(in.phi, in.rates[0], kMostBank)) return InputEnd::kBank;
  if (holds(kElevator) && soon_beyond(in.theta, in.rates[1], kMostPitch)) return InputEnd::kPitch;
  uint16_t rest_us = static_cast<uint16_t>(static_cast<uint16_t>(now_us) - stepped_us_);
  if (rest_us > kMostStepUs) rest_us = kMostStepUs;
  const uint16_t most = ticks_at(rate_max_usps_, rest_us);
  // Of a card that is slow the time adds up until it is worth a tick.
  if (most != 0) stepped_us_ = static_cast<uint16_t>(now_us);
  InputEnd why = InputEnd::kDone;
  for (uint8_t axis = 0; axis < kHeldAxes; ++axis) {
    if (!holds(axis)) continue;
    const int16_t wanted = axes_[axis].demand(axis == kAileron ? in.phi : in.theta, in.rates[axis]);
    applied_ticks[axis] = towards(applied_ticks[axis], wanted, most);
    if (axes_[axis].loses(applied_ticks[axis])) why = InputEnd::kHoldLoses;
  }
  return why;
}

}  // namespace core
