#include "app/ascii_row.h"

#include "core/progmem.h"
#include "hal/serial.h"

namespace app {

namespace {

constexpr uint8_t kLongestReading = 24;
constexpr int32_t kNoValue = 500;

// One behind the other, each ended by a zero; the separators stand before the labels.
constexpr char kLabels[] CORE_FLASH =
    "RLL:\0,PCH:\0,YAW:\0,altitude:\0,velocitya:\0,velocityb:\0,alphaa:\0,alphab:\0,betaa:\0"
    ",betab:\0,AN0:\0,AN1:\0,AN2:\0,AN3:\0,AN4:\0,AN5:\0,lat:\0,lon:\0,gpsgc:\0,gpsgs:\0,fix:\0"
    ",numsat:\0,elevs:\0,ails:\0,rdrs:\0,throts:\0,000000000000000\r";

enum Reading : uint8_t {
  kRoll,
  kPitch,
  kYaw,
  kAltitude,
  kVelocityA,
  kVelocityB,
  kAlphaA,
  kAlphaB,
  kBetaA,
  kBetaB,
  kAn0,
  kAn5 = kAn0 + 5,
  kLatitude,
  kLongitude,
  kCourse,
  kSpeed,
  kFix,
  kSatellites,
  kElevator,
  kAileron,
  kRudder,
  kThrottle,
};

// 44330 m * (1 - (p / 101325 Pa)^0.1903) from 20 kPa on, every 2 kPa. Linear between:
// 0.5 m off near the ground, 5 m at 11 km.
constexpr uint32_t kLowestPa = 20000;
constexpr uint32_t kStepPa = 2000;
constexpr uint8_t kAltitudes = 46;
constexpr int16_t kAltitudeM[kAltitudes] CORE_FLASH = {
    11777, 11181, 10627, 10110, 9624, 9165, 8731, 8318, 7924, 7547, 7187, 6840,
    6507,  6185,  5875,  5575,  5285, 5004, 4730, 4465, 4207, 3956, 3711, 3473,
    3240,  3013,  2791,  2573,  2361, 2153, 1949, 1750, 1554, 1362, 1174, 989,
    807,   629,   453,   281,   111,  -56,  -220, -382, -541, -698,
};

// Pulse range of the thesis's transmitter, us, by channel.
constexpr uint16_t kPulseMinUs[core::kServos] CORE_FLASH = {1100, 1152, 1124, 1100};
constexpr uint16_t kPulseMaxUs[core::kServos] CORE_FLASH = {1956, 1904, 1904, 1960};

uint32_t square_root(uint32_t value) {
  uint32_t root = 0;
  for (uint32_t bit = 1UL << 30; bit != 0; bit >>= 2) {
    if (value >= root + bit) {
      value -= root + bit;
      root = (root >> 1) + bit;
    } else {
      root >>= 1;
    }
  }
  return root;
}

}  // namespace

int16_t pressure_altitude_m(uint32_t static_pressure_16th_pa) {
  const uint32_t pressure_pa = static_pressure_16th_pa / 16U;
  if (pressure_pa < kLowestPa || pressure_pa >= kLowestPa + kStepPa * (kAltitudes - 1U)) {
    return INT16_MIN;
  }
  const uint8_t row = static_cast<uint8_t>((pressure_pa - kLowestPa) / kStepPa);
  const int32_t part_pa = static_cast<int32_t>((pressure_pa - kLowestPa) % kStepPa);
  const int32_t before = core::flash_load(&kAltitudeM[row]);
  const int32_t behind = core::flash_load(&kAltitudeM[row + 1]);
  return static_cast<int16_t>(before + (behind - before) * part_pa / static_cast<int32_t>(kStepPa));
}

uint16_t airspeed_centi_kmph(uint16_t sum) {
  constexpr uint16_t kZero = 2048;
  if (sum <= kZero) return 0;
  // v^2 = 2 q / 1.225; q = 1.2207 Pa per step of the sum; 360 times m/s is 0.01 km/h.
  return static_cast<uint16_t>(square_root(static_cast<uint32_t>(sum - kZero) * 258290U));
}

void AsciiRow::step(const Sensors& sensors,
                    const core::RcChannels& rc,
                    Telemetry& telemetry,
                    uint32_t now_us) {
  if (telemetry.mode() != frames::Telemetry::kAscii) return;
  if (next_ > kReadings) {
    if (!turn_.due(now_us, kPeriodUs) || !telemetry.reserve(kLongestRow, now_us)) return;
    next_ = 0;
    label_ = kLabels;
  }
  if (out_.room() < kLongestReading) return;
  out_.flash(label_);
  while (core::flash_u8(label_) != 0) ++label_;
  ++label_;
  if (next_ < kReadings) reading(sensors, rc);
  ++next_;
}

void AsciiRow::reading(const Sensors& sensors, const core::RcChannels& rc) {
  const frames::IdentFrame& ident = sensors.ident();
  // The vanes: the count times 90/27, less that of the middle.
  const auto vane = [this](uint16_t sum) {
    out_.number((static_cast<int32_t>(sum) - 2048) * 10 / 12);
  };
  switch (next_) {
    case kRoll:
      return attitude(ident.phi);
    case kPitch:
      return attitude(ident.theta);
    case kYaw:
      return attitude(ident.psi);
    case kAltitude: {
      const int16_t altitude_m = pressure_altitude_m(sensors.baro().static_pressure);
      return out_.number(altitude_m == INT16_MIN ? kNoValue : altitude_m);
    }
    case kVelocityA:
      return out_.fixed(airspeed_centi_kmph(ident.dp_a), 2);
    case kVelocityB:
      return out_.fixed(airspeed_centi_kmph(ident.dp_b), 2);
    case kAlphaA:
      return vane(ident.alpha_a);
    case kAlphaB:
      return vane(ident.alpha_b);
    case kBetaA:
      return vane(ident.beta_a);
    case kBetaB:
      return vane(ident.beta_b);
    case kElevator:
      return surface(rc, core::kElevator);
    case kAileron:
      return surface(rc, core::kAileron);
    case kRudder:
      return surface(rc, core::kRudder);
    case kThrottle:
      return surface(rc, core::kThrottle);
    default:
      if (next_ <= kAn5) return imu(ident, static_cast<uint8_t>(next_ - kAn0));
      return position(sensors, next_);
  }
}

void AsciiRow::attitude(int16_t angle) {
  out_.fixed(angle == INT16_MIN ? 100 * kNoValue : angle, 2);
}

void AsciiRow::imu(const frames::IdentFrame& ident, uint8_t axis) {
  const int16_t raw[6] = {ident.p, ident.q, ident.r, ident.ax, ident.ay, ident.az};
  const int32_t value = raw[axis];
  const bool original = (ident.valid & frames::kValidImuOriginal) != 0;
  if (value == INT16_MIN) {
    out_.fixed(100 * kNoValue, 2);
  } else if (original) {
    out_.fixed(100 * value, 2);
  } else if (axis < 3) {
    out_.fixed(value * 2504 / 100, 2);  // 65.5 to 16.4 counts per deg/s
  } else {
    out_.fixed(-100 * value, 2);  // the original prints minus specific force
  }
}

void AsciiRow::position(const Sensors& sensors, uint8_t which) {
  const frames::GpsFrame& gps = sensors.gps();
  const bool heard = (sensors.heard() & frames::kSensorsGps) != 0 && gps.fix >= 2;
  switch (which) {
    case kLatitude:
      return out_.fixed(heard ? gps.latitude / 100 : 100000 * kNoValue, 5);
    case kLongitude:
      return out_.fixed(heard ? gps.longitude / 100 : 100000 * kNoValue, 5);
    case kCourse:
      return out_.fixed(heard ? gps.course : 100 * kNoValue, 2);
    case kSpeed:
      return out_.fixed(heard ? gps.ground_speed : 100 * kNoValue, 2);
    case kFix:
      return out_.fixed(heard ? 100 : 0, 2);
    default:
      return out_.fixed(heard ? 100 * gps.satellites : 0, 2);
  }
}

void AsciiRow::surface(const core::RcChannels& rc, uint8_t channel) {
  const int32_t pulse_us = rc.width_ticks[channel] / core::kTicksPerUs;
  if (pulse_us == 0) {
    out_.fixed(100 * kNoValue, 2);
    return;
  }
  const int32_t low_us = core::flash_load(&kPulseMinUs[channel]);
  const int32_t high_us = core::flash_load(&kPulseMaxUs[channel]);
  const int32_t mapped = (pulse_us - low_us) * 1000 / (high_us - low_us) + 1000;
  switch (channel) {
    case core::kElevator:
      return out_.fixed((756 * mapped - 1087200) / 100, 2);
    case core::kAileron:
      return out_.fixed((738 * mapped - 1122900) / 100, 2);
    case core::kRudder:
      // Two lines that do not meet at 1348, as the thesis has them.
      return out_.fixed((mapped < 1348 ? 555 * mapped - 733350 : 333 * mapped - 454340) / 100, 2);
    default:
      return out_.fixed(100 * (mapped - 1009), 2);
  }
}

}  // namespace app
