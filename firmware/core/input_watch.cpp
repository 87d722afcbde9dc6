#include "core/input_watch.h"

namespace core {
namespace {

using frames::InputEnd;

constexpr uint8_t kNone = 255;
constexpr uint8_t kMoveShift = 14;  // 16.384 ms
constexpr uint8_t kStale = 0xFE;    // 4.16 s ago: as long as it is counted
constexpr uint8_t kPaShift = 4;

uint8_t low(uint32_t value) {
  return static_cast<uint8_t>(value ^ value >> 8);
}

uint8_t now_steps(uint32_t now_us) {
  return static_cast<uint8_t>(now_us >> kMoveShift);
}

bool inside(uint16_t value, uint16_t least, uint16_t most) {
  return value >= least && value <= most;
}

uint16_t size_of(int16_t value) {
  return value < 0 ? static_cast<uint16_t>(-static_cast<int32_t>(value))
                   : static_cast<uint16_t>(value);
}

// Value of a watched analogue input; its slot is its bit of ident.valid.
uint16_t analog(const uint16_t* pair, uint8_t input) {
  return pair[input & 1U];
}

bool usable(const InputReadings& in, uint8_t input) {
  return (in.valid >> input & 1U) != 0;
}

struct Judge {
  const InputReadings& in;
  const InputMotion& motion;
  uint16_t still_ms;
  uint32_t now_us;

  InputEnd watched(uint8_t sensor) const {
    const uint16_t still =
        static_cast<uint16_t>(still_ms + (sensor == InputMotion::kGps ? kInputGpsMoreMs : 0U));
    return motion.moves(sensor, still, now_us) ? InputEnd::kDone : InputEnd::kSensorStill;
  }

  InputEnd analog_input(uint8_t sensor,
                        const uint16_t* pair,
                        uint8_t input,
                        uint16_t least,
                        uint16_t most,
                        InputEnd left) const {
    if (input == kNone) return InputEnd::kDone;
    if (in.scan_age_us > kInputScanAgeUs || !usable(in, input)) return InputEnd::kSensorLost;
    if (!inside(analog(pair, input), least, most)) return left;
    return watched(sensor);
  }

  InputEnd height(const CardHead& limits, const InputHome& home) const {
    if (in.static_pressure == 0 || in.baro_age_us > kInputBaroAgeUs) return InputEnd::kSensorLost;
    const int32_t drop_pa = static_cast<int32_t>(home.pressure_2pa) * 2 -
                            static_cast<int32_t>(in.static_pressure >> kPaShift);
    if (drop_pa < limits.height_min_pa || drop_pa > limits.height_max_pa) return InputEnd::kHeight;
    return watched(InputMotion::kBaro);
  }

  InputEnd distance(const CardHead& limits, const InputHome& home) const {
    if (limits.distance_max_m == 0) return InputEnd::kDone;
    if (!in.gps || in.gps_age_us > kInputGpsAgeUs) return InputEnd::kSensorLost;
    if (!within_distance(home, in.latitude, in.longitude, limits.distance_max_m)) {
      return InputEnd::kDistance;
    }
    return watched(InputMotion::kGps);
  }
};

// Metres of a difference of 1e-7 deg along a meridian: 0.011139 for 0.011132, without a division;
// far beyond 3 km it stays far.
uint32_t metres(int32_t difference) {
  constexpr uint32_t kFar = 10000000;  // 1 deg
  uint32_t size =
      difference < 0 ? 0U - static_cast<uint32_t>(difference) : static_cast<uint32_t>(difference);
  if (size > kFar) size = kFar;
  return (size >> 4) * 730U >> 12;
}

}  // namespace

void InputMotion::start(uint32_t now_us) {
  for (uint8_t i = 0; i < kSensors; ++i) {
    value[i] = 0;
    moved[i] = static_cast<uint8_t>(now_steps(now_us) - kStale);
  }
}

void InputMotion::look(const CardHead& limits, const InputReadings& in, uint32_t now_us) {
  uint16_t imu = 0;
  for (uint8_t i = 0; i < 3; ++i) {
    imu = static_cast<uint16_t>(imu * 3U + static_cast<uint16_t>(in.rates[i]) +
                                static_cast<uint16_t>(in.force[i]));
  }
  const uint8_t seen[kSensors] = {
      low(imu),
      low(analog(in.pitot, limits.airspeed_input)),
      low(analog(in.alpha, limits.alpha_input)),
      low(analog(in.beta, limits.beta_input)),
      low(in.static_pressure),
      low(static_cast<uint32_t>(in.latitude) * 3U + static_cast<uint32_t>(in.longitude))};
  const uint8_t now = now_steps(now_us);
  for (uint8_t i = 0; i < kSensors; ++i) {
    if (seen[i] != value[i]) {
      value[i] = seen[i];
      moved[i] = now;
    } else if (static_cast<uint8_t>(now - moved[i]) > kStale) {
      moved[i] = static_cast<uint8_t>(now - kStale);
    }
  }
}

bool InputMotion::moves(uint8_t sensor, uint16_t still_ms, uint32_t now_us) const {
  const uint8_t steps = static_cast<uint8_t>(now_steps(now_us) - moved[sensor]);
  return static_cast<uint32_t>(steps) << kMoveShift <= static_cast<uint32_t>(still_ms) * 1000U;
}

InputEnd judge_imu(const CardHead& limits, const InputReadings& in) {
  if (!in.imu || in.imu_age_us > kInputImuAgeUs) return InputEnd::kSensorLost;
  if (size_of(in.phi) > limits.phi_max) return InputEnd::kBank;
  if (in.theta < limits.theta_min || in.theta > limits.theta_max) return InputEnd::kPitch;
  if (size_of(in.rates[0]) > limits.p_max || size_of(in.rates[1]) > limits.q_max ||
      size_of(in.rates[2]) > limits.r_max) {
    return InputEnd::kRates;
  }
  return in.force[2] < limits.az_min || in.force[2] > limits.az_max ? InputEnd::kLoadFactor
                                                                    : InputEnd::kDone;
}

InputEnd judge_others(const CardHead& limits,
                      const InputReadings& in,
                      const InputHome& home,
                      const InputMotion& motion,
                      uint32_t now_us) {
  const Judge judge = {in, motion, limits.still_ms, now_us};
  InputEnd why = judge.watched(InputMotion::kImu);
  if (why != InputEnd::kDone) return why;
  why = judge.analog_input(InputMotion::kAirspeed,
                           in.pitot,
                           limits.airspeed_input,
                           limits.dp_min,
                           limits.dp_max,
                           InputEnd::kAirspeed);
  if (why != InputEnd::kDone) return why;
  why = judge.analog_input(InputMotion::kAlpha,
                           in.alpha,
                           limits.alpha_input,
                           limits.alpha_min,
                           limits.alpha_max,
                           InputEnd::kAlpha);
  if (why != InputEnd::kDone) return why;
  why = judge.analog_input(InputMotion::kBeta,
                           in.beta,
                           limits.beta_input,
                           limits.beta_min,
                           limits.beta_max,
                           InputEnd::kBeta);
  if (why != InputEnd::kDone) return why;
  why = judge.height(limits, home);
  if (why != InputEnd::kDone) return why;
  why = judge.distance(limits, home);
  if (why != InputEnd::kDone) return why;
  return limits.rail_min != 0 && in.rail < limits.rail_min ? InputEnd::kSupply : InputEnd::kDone;
}

// Bhaskara's (32400 - 4 d^2) / (32400 + d^2), within 0.0017; of the degree nearer to the equator,
// so that no distance comes out too short.
uint8_t home_cosine(int32_t latitude) {
  const int32_t degrees = latitude / 10000000;
  const uint32_t square = static_cast<uint32_t>(degrees * degrees);
  if (square >= 8100U) return 0;
  const uint32_t share = (32400U - 4U * square) * 256U / (32400U + square);
  return static_cast<uint8_t>(share > 255U ? 255U : share);
}

bool within_distance(const InputHome& home, int32_t latitude, int32_t longitude, uint16_t most_m) {
  // Unsigned: across the date line the difference wraps far outside, which refuses.
  const int32_t north =
      static_cast<int32_t>(static_cast<uint32_t>(latitude) - static_cast<uint32_t>(home.latitude));
  const int32_t east = static_cast<int32_t>(static_cast<uint32_t>(longitude) -
                                            static_cast<uint32_t>(home.longitude));
  const uint32_t north_m = metres(north);
  const uint32_t east_m = metres(east) * (home.cosine + 1U) >> 8;
  if (north_m > most_m || east_m > most_m) return false;
  return north_m * north_m + east_m * east_m <= static_cast<uint32_t>(most_m) * most_m;
}

}  // namespace core
