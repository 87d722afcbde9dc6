// Is the aircraft where an input may be flown? Each limit of the card wants a sensor that is heard,
// that is neither open nor at its end, and whose value moved within the card's `still_ms`: a sensor
// that repeats itself is stuck, and a stuck sensor proves no limit.
#pragma once

#include <stdint.h>

#include "core/flight_card.h"

namespace core {

// As Sensors has them; raw as in the frames `ident`, `baro`, `gps`.
struct InputReadings {
  int16_t rates[3];
  int16_t force[3];
  int16_t phi;
  int16_t theta;
  uint16_t pitot[2];  // a, b
  uint16_t alpha[2];
  uint16_t beta[2];
  uint16_t valid;  // ident.valid of the last scan
  uint16_t rail;
  uint32_t imu_age_us;
  uint32_t scan_age_us;
  uint32_t baro_age_us;
  uint32_t gps_age_us;
  uint32_t static_pressure;  // 1/16 Pa; 0: none
  int32_t latitude;          // 1e-7 deg
  int32_t longitude;
  bool imu;  // of our own firmware, unsaturated, with an attitude
  bool gps;  // with a fix
};

// Where the card was enabled.
struct InputHome {
  uint16_t pressure_2pa = 0;  // static pressure in 2 Pa
  int32_t latitude = 0;
  int32_t longitude = 0;
  uint8_t cosine = 0;  // of the latitude, (cosine + 1) / 256
};
uint8_t home_cosine(int32_t latitude);

// When each sensor's value last moved, in 16 ms; for the time of a trigger and its input.
struct InputMotion {
  enum : uint8_t { kImu, kAirspeed, kAlpha, kBeta, kBaro, kGps, kSensors };

  uint8_t value[kSensors];
  uint8_t moved[kSensors];

  // Nothing has been seen to move yet.
  void start(uint32_t now_us);
  void look(const CardHead& limits, const InputReadings& in, uint32_t now_us);
  // Of a sensor that moved within `still_ms`.
  bool moves(uint8_t sensor, uint16_t still_ms, uint32_t now_us) const;
};

// A value this old is none: two to three periods of its sensor at its slowest.
constexpr uint32_t kInputImuAgeUs = 30000;
constexpr uint32_t kInputScanAgeUs = 100000;  // identification frames at 25 Hz
constexpr uint32_t kInputBaroAgeUs = 150000;
constexpr uint32_t kInputGpsAgeUs = 1000000;
constexpr uint16_t kInputGpsMoreMs = 1000;

// With each packet: of the head the fields from phi_max to az_max are looked at. kDone: inside.
frames::InputEnd judge_imu(const CardHead& limits, const InputReadings& in);
// With each frame: all others from airspeed_input to rail_min.
frames::InputEnd judge_others(const CardHead& limits,
                              const InputReadings& in,
                              const InputHome& home,
                              const InputMotion& motion,
                              uint32_t now_us);

// Are the two places at most `most_m` apart? Within 1 % up to 3 km and 75 deg of latitude.
bool within_distance(const InputHome& home, int32_t latitude, int32_t longitude, uint16_t most_m);

}  // namespace core
