// Running finite Fourier transforms of a few signals at a few harmonics, in 32-bit integers.
// Morelli, Real-time parameter estimation in the frequency domain, J. Guidance 23 (2000).
#pragma once

#include <stdint.h>

#include "core/learning/axis_card.h"
#include "core/learning/rotation.h"

namespace core {

constexpr uint8_t kSampleHz = 50;
// 60 s. |value| <= 2^15 and |factor| <= 2^12, so |share| <= 2^19 and |sum| <= 3000 * 2^19 < 2^31.
constexpr uint16_t kMostSamples = 60 * kSampleHz;

struct ComplexSum {
  int32_t re;
  int32_t im;
};

// What one sample adds: value * factor / 2^8, rounded to the nearest.
inline int32_t share_of(int16_t value, int16_t factor_q12) {
  return (static_cast<int32_t>(value) * factor_q12 + 128) >> 8;
}

static_assert(INT64_C(3000) * ((INT64_C(32768) * 4096 + 128) >> 8) < INT32_MAX, "may overflow");

class FourierSums {
 public:
  // False, and nothing started, where the card wants more sums than there are.
  bool start(const AxisCard& card);
  // Raw counts in the order of the axis, every 20 ms; a lost sample is given as the last one again.
  // The first is the origin of all. False when 60 s are full: nothing is added any more.
  bool take(const AxisCard& card, const int16_t* values);

  uint16_t count() const { return count_; }
  uint8_t signals() const { return signals_; }
  // Newest value from the origin, within 16 bits.
  int16_t last(uint8_t signal) const { return last_[signal]; }
  ComplexSum at(uint8_t harmonic, uint8_t signal) const {
    const int32_t* sum = &sums_[2 * (harmonic * signals_ + signal)];
    return {sum[0], sum[1]};
  }
  // Phase of a harmonic at the newest sample.
  static uint16_t step(uint8_t harmonic, uint16_t count) {
    return static_cast<uint16_t>(harmonic * static_cast<uint16_t>(count - 1U));
  }

 private:
  int32_t sums_[2 * kMostSums];  // real and imaginary part of every signal, harmonic by harmonic
  int16_t origin_[kMostSignals];
  int16_t last_[kMostSignals];
  uint16_t count_ = 0;
  uint8_t signals_ = 0;
};

}  // namespace core
