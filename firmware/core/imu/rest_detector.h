// Whether the IMU lies still, and what its sensors mean over that second. A parked aircraft, motor
// off, passes; the quietest flight does not.
#pragma once

#include <stdint.h>

namespace core {

class RestDetector {
 public:
  static constexpr uint8_t kWindow = 200;       // 1 s at 200 Hz
  static constexpr int16_t kRateSpread = 131;   // 2 deg/s peak to peak; noise alone gives 20 LSB
  static constexpr int16_t kForceSpread = 500;  // 0.06 g peak to peak; noise alone gives 200 LSB
  static constexpr int16_t kMostRate = 1638;    // 25 deg/s: offset of an uncalibrated gyro
  static constexpr uint16_t kForceOff = 1229;   // 0.15 g from 1 g: a steady turn is no rest
  static constexpr int16_t kMeanDrift = 16;     // 0.25 deg/s from second to second: a slow start
  static constexpr uint8_t kWindowsNeeded = 2;

  // Rates without any offset taken off, 65.5 LSB per deg/s; force 8192 LSB per g.
  void add(const int16_t (&rates)[3], const int16_t (&force)[3]);

  // The last two whole windows were still, and so is the present one up to now.
  bool at_rest() const { return still_ == kWindowsNeeded && quiet(); }
  // True once at the end of each window at rest: there are new means.
  bool take_means();
  // Means of the window before the last: what follows it was still too, so that no beginning of a
  // motion is in it.
  int16_t mean_rate(uint8_t axis) const { return older_[axis]; }
  int16_t mean_force(uint8_t axis) const { return older_[3 + axis]; }

 private:
  bool quiet() const;
  void finish();

  int32_t sum_[6] = {};
  int16_t least_[6] = {};
  int16_t most_[6] = {};
  int16_t mean_[6] = {};
  int16_t older_[6] = {};
  uint8_t count_ = 0;
  uint8_t still_ = 0;
  bool fresh_ = false;
};

}  // namespace core
