// Flying beyond doubt, asked before a test input moves a surface and in each look behind it. An
// engine on the stand, a hand and a car's door make throttle, vibration and pressure; so none of
// them is asked here. For 3 s without a gap one of these must have said so, each for itself:
//
//   pitot  the one that the card watches, at or above the card's least airspeed and 100 Pa (12.8
//   m/s)
//          above its zero, which is taken where the card is enabled: wind of 12 m/s makes 88 Pa
//   GPS    faster than 5 m/s over ground, with a fix: a receiver that wanders does not for 3 s
//
// Height is judge_baro's: at least frames::kCardLeastHeightPa above home, whatever the card says.
#pragma once

#include <stdint.h>

#include "core/input_watch.h"

namespace core {

class FlyingProof {
 public:
  static constexpr uint16_t kPitotAboveZero = 82;  // 1.22 Pa each
  static constexpr uint16_t kMovingCmps = 500;
  static constexpr uint8_t kSteps = 185;  // of 16.384 ms: above 3 s wherever in a step it began

  // Where the card is enabled, on the ground. Without a pitot that the card watches, or with one
  // whose reading is not within the sensor's band of zero, GPS alone is left.
  void tare(uint8_t airspeed_input, uint16_t dp_min, const InputReadings& in, uint32_t now_us);
  // With every scan, at least each 0.2 s; ages of the readings are those at now_us.
  void look(const InputReadings& in, uint32_t now_us);
  bool holds() const { return holds_; }

 private:
  static constexpr uint16_t kNoPitot = 0x7FFF;  // above any reading
  static constexpr uint16_t kPitotB = 0x8000;   // beside the least reading

  uint16_t pitot_least_ = kNoPitot;
  // When each last said no, in 16.384 ms.
  uint8_t pitot_no_ = 0;
  uint8_t gps_no_ = 0;
  bool holds_ = false;
};

}  // namespace core
