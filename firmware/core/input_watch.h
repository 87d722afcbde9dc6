// Is the aircraft where an input may be flown? Each limit of the card wants a sensor that is heard,
// that is neither open nor at its end, and whose value moved within the card's `still_ms`: a sensor
// that repeats itself is stuck, and a stuck sensor proves no limit.
#pragma once

#include <stdint.h>

#include "core/flight_card.h"

namespace core {

// Without the sign; of -32768 too.
inline uint16_t size_of(int16_t value) {
  return value < 0 ? static_cast<uint16_t>(-static_cast<int32_t>(value))
                   : static_cast<uint16_t>(value);
}

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
  uint16_t ground_speed_cmps;  // 0: without a fix
  bool imu;                    // of our own firmware, unsaturated, with an attitude
  bool gps;                    // with a fix
};

// Where the card was enabled.
struct InputHome {
  uint16_t pressure_2pa = 0;  // static pressure in 2 Pa
  int32_t latitude = 0;
  int32_t longitude = 0;
  uint8_t cosine = 0;  // of the latitude, (cosine + 1) / 256
};
uint8_t home_cosine(int32_t latitude);

// Of a card's head the fields from airspeed_input to rail_min, byte for byte: what a look compares.
struct InputLimits {
  uint8_t airspeed_input;
  uint8_t alpha_input;
  uint8_t beta_input;
  uint8_t learned_axes;
  uint16_t dp_min;
  uint16_t dp_max;
  uint16_t alpha_min;
  uint16_t alpha_max;
  uint16_t beta_min;
  uint16_t beta_max;
  uint16_t phi_max;
  int16_t theta_min;
  int16_t theta_max;
  uint16_t p_max;
  uint16_t q_max;
  uint16_t r_max;
  int16_t az_min;
  int16_t az_max;
  uint16_t height_min_pa;
  uint16_t height_max_pa;
  uint16_t distance_max_m;
  uint16_t still_ms;
  uint16_t stick_us;
  uint16_t rail_min;
};
constexpr uint8_t kInputLimitsOffset = offsetof(CardHead, airspeed_input);
static_assert(
    sizeof(InputLimits) == offsetof(CardHead, servo_min_us) - kInputLimitsOffset &&
        offsetof(InputLimits, dp_min) == offsetof(CardHead, dp_min) - kInputLimitsOffset &&
        offsetof(InputLimits, phi_max) == offsetof(CardHead, phi_max) - kInputLimitsOffset &&
        offsetof(InputLimits, az_max) == offsetof(CardHead, az_max) - kInputLimitsOffset &&
        offsetof(InputLimits, rail_min) == offsetof(CardHead, rail_min) - kInputLimitsOffset,
    "a copy of the head's bytes");

// A time in steps of 16.384 ms.
uint8_t steps_16ms(uint32_t time_us);

// When each sensor's value last moved, in 16 ms; for the time of a trigger and its input.
struct InputMotion {
  enum : uint8_t { kImu, kAirspeed, kAlpha, kBeta, kBaro, kGps, kSensors };

  uint8_t value[kSensors];
  uint8_t moved[kSensors];

  // Nothing has been seen to move yet.
  void start(uint32_t now_us);
  // On the news of each sensor.
  void see_imu(const InputReadings& in, uint32_t now_us);
  void see_scan(const InputLimits& limits, const InputReadings& in, uint32_t now_us);
  void see_baro(const InputReadings& in, uint32_t now_us);
  void see_gps(const InputReadings& in, uint32_t now_us);
  // Once in 4 s at least: no count comes round.
  void age(uint32_t now_us);
  // Whole steps of 16.384 ms in a time, at most 255.
  static uint8_t steps_of(uint16_t still_ms);
  // Of a sensor that moved within so many.
  bool moves(uint8_t sensor, uint8_t still_steps, uint32_t now_us) const;

 private:
  void see(uint8_t sensor, uint8_t seen, uint32_t now_us);
};

// A value this old is none: two to three periods of its sensor at its slowest.
constexpr uint32_t kInputImuAgeUs = 30000;
constexpr uint32_t kInputScanAgeUs = 100000;  // identification frames at 25 Hz
constexpr uint32_t kInputBaroAgeUs = 150000;
constexpr uint32_t kInputGpsAgeUs = 1000000;
constexpr uint16_t kInputGpsMoreMs = 1000;

// Each part of the limits is judged on the news of its own sensor, and what was found stays.
// kDone: inside.
frames::InputEnd judge_imu(const InputLimits& limits, const InputReadings& in);
frames::InputEnd judge_scan(const InputLimits& limits, const InputReadings& in);
// However low the card lets it be, frames::kCardLeastHeightPa above home at least.
frames::InputEnd judge_baro(const InputLimits& limits,
                            const InputReadings& in,
                            const InputHome& home);
frames::InputEnd judge_gps(const InputLimits& limits,
                           const InputReadings& in,
                           const InputHome& home);
// Whether every sensor that a limit needs is heard and moves: it may cease without any news.
frames::InputEnd judge_heard(const InputLimits& limits,
                             const InputReadings& in,
                             const InputMotion& motion,
                             uint32_t now_us);

// What is known of the aircraft while an input may be flown: lent memory (app/row_memory.h).
struct InputWatch {
  enum Part : uint8_t { kImu, kScan, kBaro, kGps, kHeard, kHold, kParts };

  InputLimits limits;
  InputMotion motion;
  frames::InputEnd found[kParts];
  uint16_t looked_us;  // low half
  // Of the last news looked at.
  uint16_t baro_us;
  uint16_t gps_us;
  uint8_t scan;
  uint8_t imu;

  // Of the limits, which are there, nothing is known yet. kHold is its row's.
  void start(uint32_t now_us);
  frames::InputEnd outside() const;  // kDone: all limits hold
};

// Are the two places at most `most_m` apart? Within 1 % up to 3 km and 75 deg of latitude.
bool within_distance(const InputHome& home, int32_t latitude, int32_t longitude, uint16_t most_m);

}  // namespace core
