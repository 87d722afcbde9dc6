#include "core/imu/rest_detector.h"

#include "core/imu/fixed_point.h"

namespace core {

void RestDetector::add(const int16_t (&rates)[3], const int16_t (&force)[3]) {
  for (uint8_t i = 0; i < 6; ++i) {
    const int16_t value = i < 3 ? rates[i] : force[i - 3];
    if (count_ == 0) {
      sum_[i] = 0;
      least_[i] = most_[i] = value;
    }
    sum_[i] += value;
    least_[i] = value < least_[i] ? value : least_[i];
    most_[i] = value > most_[i] ? value : most_[i];
  }
  ++count_;
  if (count_ == kWindow) {
    finish();
    count_ = 0;
  }
}

bool RestDetector::quiet() const {
  for (uint8_t i = 0; i < 6; ++i) {
    if (int32_t{most_[i]} - least_[i] > (i < 3 ? kRateSpread : kForceSpread)) {
      return false;
    }
  }
  return true;
}

void RestDetector::finish() {
  uint32_t square = 0;
  bool still = quiet();
  for (uint8_t i = 0; i < 6; ++i) {
    const int32_t sum = sum_[i] + (sum_[i] < 0 ? -kWindow / 2 : kWindow / 2);
    older_[i] = mean_[i];
    mean_[i] = static_cast<int16_t>(sum / kWindow);
    if (i < 3) {
      const int32_t drift = int32_t{mean_[i]} - older_[i];
      const bool steady = still_ == 0 || (drift <= kMeanDrift && drift >= -kMeanDrift);
      still = still && steady && mean_[i] <= kMostRate && mean_[i] >= -kMostRate;
    } else {
      square += static_cast<uint32_t>(int32_t{mean_[i]} * mean_[i]);
    }
  }
  const uint16_t size = square_root(square);
  still = still && size <= 8192 + kForceOff && size >= 8192 - kForceOff;
  still_ = !still                    ? uint8_t{0}
           : still_ < kWindowsNeeded ? static_cast<uint8_t>(still_ + 1)
                                     : still_;
  fresh_ = still_ == kWindowsNeeded;
}

bool RestDetector::take_means() {
  const bool fresh = fresh_;
  fresh_ = false;
  return fresh;
}

}  // namespace core
