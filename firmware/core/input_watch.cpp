#include "core/input_watch.h"

namespace core {
namespace {

using frames::InputEnd;

constexpr uint8_t kNone = 255;
constexpr uint16_t kStepsPerMs = 4000;  // of 16.384 ms, in 1/65536: none beyond a time is in it
constexpr uint8_t kStale = 0xFE;        // 4.16 s ago: as long as it is counted
constexpr uint8_t kPaShift = 4;

uint8_t low(uint32_t value) {
  return static_cast<uint8_t>(value ^ value >> 8);
}

bool inside(uint16_t value, uint16_t least, uint16_t most) {
  return value >= least && value <= most;
}

// Value of a watched analogue input; its slot is its bit of ident.valid.
uint16_t analog(const uint16_t* pair, uint8_t input) {
  return pair[input & 1U];
}

bool usable(const InputReadings& in, uint8_t input) {
  return (in.valid >> input & 1U) != 0;
}

InputEnd judge_analog(const InputReadings& in,
                      const uint16_t* pair,
                      uint8_t input,
                      uint16_t least,
                      uint16_t most,
                      InputEnd left) {
  if (input == kNone) return InputEnd::kDone;
  if (!usable(in, input)) return InputEnd::kSensorLost;
  return inside(analog(pair, input), least, most) ? InputEnd::kDone : left;
}

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

// time_us / 2^14 in whole bytes and a short shift: by 14 it is a loop of 100 cycles.
uint8_t steps_16ms(uint32_t time_us) {
  const uint16_t middle = static_cast<uint16_t>(time_us >> 8U);
  return static_cast<uint8_t>(static_cast<uint16_t>(middle << 2U) >> 8U);
}

void InputMotion::start(uint32_t now_us) {
  for (uint8_t i = 0; i < kSensors; ++i) {
    value[i] = 0;
    moved[i] = static_cast<uint8_t>(steps_16ms(now_us) - kStale);
  }
}

void InputMotion::see(uint8_t sensor, uint8_t seen, uint32_t now_us) {
  if (seen == value[sensor]) return;
  value[sensor] = seen;
  moved[sensor] = steps_16ms(now_us);
}

void InputMotion::see_imu(const InputReadings& in, uint32_t now_us) {
  const auto both = [&in](uint8_t i) {
    return static_cast<uint16_t>(static_cast<uint16_t>(in.rates[i]) +
                                 static_cast<uint16_t>(in.force[i]));
  };
  const uint16_t two = static_cast<uint16_t>(both(0) * 3U + both(1));
  see(kImu, low(static_cast<uint16_t>(two * 3U + both(2))), now_us);
}

void InputMotion::see_scan(const InputLimits& limits, const InputReadings& in, uint32_t now_us) {
  see(kAirspeed, low(analog(in.pitot, limits.airspeed_input)), now_us);
  see(kAlpha, low(analog(in.alpha, limits.alpha_input)), now_us);
  see(kBeta, low(analog(in.beta, limits.beta_input)), now_us);
}

void InputMotion::see_baro(const InputReadings& in, uint32_t now_us) {
  see(kBaro, low(in.static_pressure), now_us);
}

void InputMotion::see_gps(const InputReadings& in, uint32_t now_us) {
  see(kGps,
      low(static_cast<uint32_t>(in.latitude) * 3U + static_cast<uint32_t>(in.longitude)),
      now_us);
}

void InputMotion::age(uint32_t now_us) {
  const uint8_t now = steps_16ms(now_us);
  for (uint8_t& at : moved) {
    if (static_cast<uint8_t>(now - at) > kStale) at = static_cast<uint8_t>(now - kStale);
  }
}

uint8_t InputMotion::steps_of(uint16_t still_ms) {
  const uint32_t steps = static_cast<uint32_t>(still_ms) * kStepsPerMs >> 16U;
  return steps > UINT8_MAX ? uint8_t{UINT8_MAX} : static_cast<uint8_t>(steps);
}

bool InputMotion::moves(uint8_t sensor, uint8_t still_steps, uint32_t now_us) const {
  return static_cast<uint8_t>(steps_16ms(now_us) - moved[sensor]) <= still_steps;
}

InputEnd judge_imu(const InputLimits& limits, const InputReadings& in) {
  if (!in.imu) return InputEnd::kSensorLost;
  if (size_of(in.phi) > limits.phi_max) return InputEnd::kBank;
  if (in.theta < limits.theta_min || in.theta > limits.theta_max) return InputEnd::kPitch;
  if (size_of(in.rates[0]) > limits.p_max || size_of(in.rates[1]) > limits.q_max ||
      size_of(in.rates[2]) > limits.r_max) {
    return InputEnd::kRates;
  }
  return in.force[2] < limits.az_min || in.force[2] > limits.az_max ? InputEnd::kLoadFactor
                                                                    : InputEnd::kDone;
}

InputEnd judge_scan(const InputLimits& limits, const InputReadings& in) {
  InputEnd why = judge_analog(
      in, in.pitot, limits.airspeed_input, limits.dp_min, limits.dp_max, InputEnd::kAirspeed);
  if (why != InputEnd::kDone) return why;
  why = judge_analog(
      in, in.alpha, limits.alpha_input, limits.alpha_min, limits.alpha_max, InputEnd::kAlpha);
  if (why != InputEnd::kDone) return why;
  why = judge_analog(
      in, in.beta, limits.beta_input, limits.beta_min, limits.beta_max, InputEnd::kBeta);
  if (why != InputEnd::kDone) return why;
  return limits.rail_min != 0 && in.rail < limits.rail_min ? InputEnd::kSupply : InputEnd::kDone;
}

InputEnd judge_baro(const InputLimits& limits, const InputReadings& in, const InputHome& home) {
  if (in.static_pressure == 0) return InputEnd::kSensorLost;
  const int32_t drop_pa = static_cast<int32_t>(home.pressure_2pa) * 2 -
                          static_cast<int32_t>(in.static_pressure >> kPaShift);
  const bool high = drop_pa >= limits.height_min_pa && drop_pa >= frames::kCardLeastHeightPa;
  return high && drop_pa <= limits.height_max_pa ? InputEnd::kDone : InputEnd::kHeight;
}

InputEnd judge_gps(const InputLimits& limits, const InputReadings& in, const InputHome& home) {
  if (limits.distance_max_m == 0) return InputEnd::kDone;
  if (!in.gps) return InputEnd::kSensorLost;
  return within_distance(home, in.latitude, in.longitude, limits.distance_max_m)
             ? InputEnd::kDone
             : InputEnd::kDistance;
}

InputEnd judge_heard(const InputLimits& limits,
                     const InputReadings& in,
                     const InputMotion& motion,
                     uint32_t now_us) {
  const bool airspeed = limits.airspeed_input != kNone;
  const bool alpha = limits.alpha_input != kNone;
  const bool beta = limits.beta_input != kNone;
  const bool gps = limits.distance_max_m != 0;
  if (in.imu_age_us > kInputImuAgeUs || in.baro_age_us > kInputBaroAgeUs ||
      ((airspeed || alpha || beta) && in.scan_age_us > kInputScanAgeUs) ||
      (gps && in.gps_age_us > kInputGpsAgeUs)) {
    return InputEnd::kSensorLost;
  }
  const uint8_t still = InputMotion::steps_of(limits.still_ms);
  const auto moves = [&](uint8_t sensor) { return motion.moves(sensor, still, now_us); };
  const bool all =
      moves(InputMotion::kImu) && moves(InputMotion::kBaro) &&
      (!airspeed || moves(InputMotion::kAirspeed)) && (!alpha || moves(InputMotion::kAlpha)) &&
      (!beta || moves(InputMotion::kBeta)) &&
      (!gps ||
       motion.moves(InputMotion::kGps,
                    InputMotion::steps_of(static_cast<uint16_t>(limits.still_ms + kInputGpsMoreMs)),
                    now_us));
  return all ? InputEnd::kDone : InputEnd::kSensorStill;
}

void InputWatch::start(uint32_t now_us) {
  motion.start(now_us);
  for (InputEnd& part : found) part = InputEnd::kSensorLost;
  found[kHold] = InputEnd::kDone;
  // Of a GPS that is not there no news ever comes.
  if (limits.distance_max_m == 0) found[kGps] = InputEnd::kDone;
  looked_us = static_cast<uint16_t>(now_us);
}

InputEnd InputWatch::outside() const {
  for (const InputEnd part : found) {
    if (part != InputEnd::kDone) return part;
  }
  return InputEnd::kDone;
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
