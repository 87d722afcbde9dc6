// What the flight card tells the learning of one axis: harmonics, how late sensors are, and what a
// ratio of counts is worth. `host.planning.learning_card` makes it from aircraft and calibration.
#pragma once

#include <stdint.h>

namespace core {

// Signals in this order. Pitch: angle of attack, pitch rate, elevator. Roll and yaw: sideslip, roll
// rate, yaw rate, aileron, rudder.
enum class LearningAxis : uint8_t { kPitch, kRoll, kYaw };

constexpr uint8_t kMostSignals = 5;
constexpr uint8_t kMostHarmonics = 10;
// Of angle and surfaces; rates are the clock that the others are late against.
constexpr uint8_t kMostAdvances = 3;

struct AxisCard {
  LearningAxis axis;
  uint8_t harmonic_count;
  uint8_t harmonics[kMostHarmonics];  // times 50 / 512 Hz
  uint8_t told;                       // bit by bit, as the signals; each that is not saves 1 ms
  // A signal x is x + advance x' + curvature x''; in s and s2.
  float advance_s[kMostAdvances];
  float curvature_s2[kMostAdvances];
  // Counts of the angle at the CG per count of rate and second: the vane is ahead of the CG.
  float lever;
  // Share of the other rate's acceleration: Ixz / Ixx of roll, Ixz / Izz of yaw, 0 of pitch.
  float product;
};

// What a ratio of counts is worth: asked for behind a solve, so it may stay in the EEPROM until
// then.
struct DerivativeWorth {
  float gain;              // derivative of the coefficient per ratio of counts
  float tolerance;         // half-width that the instrument leaves
  uint8_t wanted_percent;  // half-width that is enough, of the estimate
};

inline uint8_t signals_of(LearningAxis axis) {
  return axis == LearningAxis::kPitch ? 3 : 5;
}
// The rate whose acceleration is the moment, and the one that turns with the angle.
inline uint8_t moment_rate(LearningAxis axis) {
  return axis == LearningAxis::kYaw ? 2 : 1;
}
inline uint8_t lever_rate(LearningAxis axis) {
  return axis == LearningAxis::kPitch ? 1 : 2;
}
// Whether a signal is a rate.
inline bool is_rate(LearningAxis axis, uint8_t signal) {
  return signal == 1 || (signal == 2 && axis != LearningAxis::kPitch);
}

}  // namespace core
