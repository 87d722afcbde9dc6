// What the flight card tells the learning of one axis: harmonics, how late sensors are, and what a
// ratio of counts is worth. `host.planning.learning_card` makes it from aircraft and calibration.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "generated/frames.h"

namespace core {

// Signals in this order. Pitch: angle of attack, pitch rate, elevator. Roll and yaw: sideslip, roll
// rate, yaw rate, aileron, rudder.
enum class LearningAxis : uint8_t { kPitch, kRoll, kYaw };

constexpr uint8_t kMostSignals = 5;
constexpr uint8_t kMostHarmonics = 10;
// Complex: ten harmonics of pitch's three signals, six of the five of roll and yaw; 240 B.
constexpr uint8_t kMostSums = 30;
// Of angle and surfaces; rates are the clock that the others are late against.
constexpr uint8_t kMostAdvances = 3;

// The bytes of the flight card's part `card_axis`.
struct __attribute__((packed)) AxisCard {
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

static_assert(sizeof(AxisCard) == offsetof(frames::CardAxisLayout, reserved) &&
                  offsetof(AxisCard, told) == offsetof(frames::CardAxisLayout, told) &&
                  offsetof(AxisCard, curvature_s2) ==
                      offsetof(frames::CardAxisLayout, curvature_s2) &&
                  offsetof(AxisCard, product) == offsetof(frames::CardAxisLayout, product),
              "as the card has it");

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
// Singles, none of which is infinite or no number: by their bits, the lowest byte first.
inline bool all_finite(const uint8_t* bytes, uint8_t singles) {
  for (; singles != 0; --singles, bytes += 4) {
    if ((bytes[3] & 0x7FU) == 0x7FU && (bytes[2] & 0x80U) != 0) return false;
  }
  return true;
}
inline bool worth_good(const frames::CardWorthLayout& worth) {
  constexpr uint8_t kSingles = 2 * kMostSignals;
  static_assert(offsetof(frames::CardWorthLayout, gain) == 0 &&
                    offsetof(frames::CardWorthLayout, wanted_percent) == 4 * kSingles,
                "gains and tolerances, and nothing between");
  return all_finite(reinterpret_cast<const uint8_t*>(&worth), kSingles);
}
// Of the harmonics and signals there is memory for all, each bit of `told` has a signal, and every
// number is one.
inline bool axis_good(const AxisCard& card) {
  constexpr uint8_t kFirst = offsetof(AxisCard, advance_s);
  const uint8_t* const singles = reinterpret_cast<const uint8_t*>(&card) + kFirst;
  if (!all_finite(singles, (sizeof card - kFirst) / 4)) return false;
  if (static_cast<uint8_t>(card.axis) > static_cast<uint8_t>(LearningAxis::kYaw)) return false;
  const uint8_t signals = signals_of(card.axis);
  return card.harmonic_count != 0 && card.harmonic_count <= kMostHarmonics &&
         card.harmonic_count * signals <= kMostSums && card.told >> signals == 0;
}
// The first of an axis's derivatives; the others follow as its signals do.
inline uint8_t first_derivative(LearningAxis axis) {
  const frames::Derivative first = axis == LearningAxis::kPitch  ? frames::Derivative::kCmAlpha
                                   : axis == LearningAxis::kRoll ? frames::Derivative::kClBeta
                                                                 : frames::Derivative::kCnBeta;
  return static_cast<uint8_t>(first);
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
