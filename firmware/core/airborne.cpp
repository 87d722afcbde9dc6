#include "core/airborne.h"

namespace core {
namespace {

void count(uint8_t& seconds) {
  if (seconds < 0xFF) {
    ++seconds;
  }
}

}  // namespace

void Airborne::start(bool flight_mark, uint32_t now_us) {
  *this = Airborne();
  mark_s_ = flight_mark ? kMarkS : uint8_t{0};
  second_us_ = now_us;
  begin_second();
}

void Airborne::begin_second() {
  pressure_sum_ = 0;
  imu_samples_ = pressure_samples_ = pitot_samples_ = fast_samples_ = 0;
  samples_ = high_samples_ = 0;
}

FlightState Airborne::step(const AirborneInputs& in, uint32_t now_us) {
  if (samples_ < kMoreSamples) {
    gather(in);
  }
  if (now_us - second_us_ >= kSecondUs) {
    // A second that was longer, because the card made the caller wait, is one all the same.
    second_us_ = now_us;
    judge(in);
    decide(in);
    begin_second();
  }
  return state_;
}

void Airborne::gather(const AirborneInputs& in) {
  ++samples_;
  if (in.throttle_valid && !in.throttle_idle) {
    ++high_samples_;
  }
  if (in.static_pressure != 0) {
    ++pressure_samples_;
    pressure_sum_ += in.static_pressure;
  }
  if (in.pitots != 0) {
    ++pitot_samples_;
    const uint16_t limit = tared_ ? kPitotMoving : kPitotUntared;
    bool fast = false;
    uint8_t bit = 1;
    for (uint8_t i = 0; i < kPitots; ++i, bit = static_cast<uint8_t>(bit << 1)) {
      fast = fast || ((in.pitots & bit) != 0 && in.pitot[i] > pitot_zero_[i] + limit);
    }
    if (fast) {
      ++fast_samples_;
    }
  }
  if (!in.imu) {
    return;
  }
  original_ = in.imu_original;
  for (uint8_t i = 0; i < 6; ++i) {
    const int16_t value = i < 3 ? in.rates[i] : in.force[static_cast<uint8_t>(i - 3)];
    if (imu_samples_ == 0) {
      least_[i] = most_[i] = value;
    }
    least_[i] = value < least_[i] ? value : least_[i];
    most_[i] = value > most_[i] ? value : most_[i];
  }
  ++imu_samples_;
}

void Airborne::vote(bool moving) {
  if (moving) {
    ++moving_;
  } else {
    ++still_;
  }
}

void Airborne::judge(const AirborneInputs& in) {
  moving_ = still_ = 0;
  if (high_samples_ == samples_) {
    vote(true);
  }
  if (mark_s_ != 0) {
    --mark_s_;
    vote(true);
  }
  if (in.gps) {
    vote(in.ground_speed_cmps > kTaxiCmps);
  }
  judge_pressure();
  judge_imu();
  if (pitot_samples_ != 0) {
    vote(fast_samples_ > pitot_samples_ / 2);
  }
}

void Airborne::judge_pressure() {
  if (pressure_samples_ == 0) {
    pressure_mean_ = 0;
    return;
  }
  const uint32_t mean = pressure_sum_ / pressure_samples_;
  if (pressure_mean_ != 0) {
    const uint32_t change = mean > pressure_mean_ ? mean - pressure_mean_ : pressure_mean_ - mean;
    vote(change > kPressureMoving);
  }
  pressure_mean_ = mean;
}

void Airborne::judge_imu() {
  if (imu_samples_ == 0) {
    return;
  }
  bool moving = false;
  for (uint8_t i = 0; i < 6; ++i) {
    const int32_t spread = int32_t{most_[i]} - least_[i];
    if (i >= 3) {
      moving = moving || spread > kForceSpread;
      continue;
    }
    const uint8_t fewer = original_ ? 4 : 1;
    moving = moving || spread * fewer > kRateSpread || int32_t{least_[i]} * fewer > kMostRate ||
             int32_t{most_[i]} * fewer < -kMostRate;
  }
  vote(moving);
}

// The moment that is found to be the ground tells the zero, within the sensor's band.
void Airborne::tare(const AirborneInputs& in) {
  uint8_t bit = 1;
  for (uint8_t i = 0; i < kPitots; ++i, bit = static_cast<uint8_t>(bit << 1)) {
    const uint16_t zero = in.pitot[i];
    if ((in.pitots & bit) != 0 && zero >= kPitotZero - kPitotOffset &&
        zero <= kPitotZero + kPitotOffset) {
      pitot_zero_[i] = zero;
      tared_ = true;
    }
  }
}

void Airborne::decide(const AirborneInputs& in) {
  if (moving_ >= 2) {
    state_ = FlightState::kFlying;
    still_s_ = alone_s_ = 0;
    return;
  }
  count(alone_s_);
  if (moving_ != 0) {
    still_s_ = 0;
  } else {
    count(still_s_);
  }
  const bool still = still_s_ >= kStillS && still_ >= 2;
  const bool nobody = still_s_ >= kAloneS;
  const bool alone = alone_s_ >= kAloneS && still_ != 0;
  if (state_ != FlightState::kGround && (still || nobody || alone)) {
    state_ = FlightState::kGround;
    tare(in);
  }
}

}  // namespace core
