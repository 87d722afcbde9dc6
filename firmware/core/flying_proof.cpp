#include "core/flying_proof.h"

namespace core {
namespace {

constexpr uint8_t kNone = 255;
constexpr uint16_t kZero = 2048;  // MPXV7002: half the supply
constexpr uint16_t kBand = 205;   // 6.25 % of 4 V, its band of error
// A time behind the last no is counted up to kMostSteps. What is longer than any two looks are
// apart is a no that is younger than its sample, by the 3 ms that looks are ahead.
constexpr uint8_t kMostSteps = 0xE0;
constexpr uint8_t kYounger = 0xF0;

// Whether a witness that says yes by a sample of this time has said so long enough.
bool long_enough(uint8_t* no, bool yes, uint32_t sample_us, uint32_t now_us) {
  if (!yes) {
    *no = steps_16ms(now_us);
    return false;
  }
  const uint8_t sample = steps_16ms(sample_us);
  const uint8_t since = static_cast<uint8_t>(sample - *no);
  if (since >= kYounger) return false;
  if (since > kMostSteps) *no = static_cast<uint8_t>(sample - kMostSteps);
  return since >= FlyingProof::kSteps;
}

}  // namespace

void FlyingProof::tare(uint8_t airspeed_input,
                       uint16_t dp_min,
                       const InputReadings& in,
                       uint32_t now_us) {
  *this = FlyingProof();
  pitot_no_ = gps_no_ = steps_16ms(now_us);
  if (airspeed_input == kNone || (in.valid >> airspeed_input & 1U) == 0) return;
  const bool b = (airspeed_input & 1U) != 0;
  const uint16_t zero = in.pitot[b ? 1 : 0];
  if (zero < kZero - kBand || zero > kZero + kBand) return;
  const uint16_t least = static_cast<uint16_t>(zero + kPitotAboveZero);
  pitot_least_ = dp_min > least ? dp_min : least;
  if (pitot_least_ > kNoPitot) pitot_least_ = kNoPitot;
  if (b) pitot_least_ |= kPitotB;
}

void FlyingProof::look(const InputReadings& in, uint32_t now_us) {
  const bool b = (pitot_least_ & kPitotB) != 0;
  const bool usable = (in.valid & (b ? frames::kValidDpB : frames::kValidDpA)) != 0;
  const bool pitot = usable && in.scan_age_us <= kInputScanAgeUs &&
                     in.pitot[b ? 1 : 0] >= (pitot_least_ & kNoPitot);
  const bool gps = in.gps_age_us <= kInputGpsAgeUs && in.ground_speed_cmps > kMovingCmps;
  const bool by_pitot = long_enough(&pitot_no_, pitot, now_us - in.scan_age_us, now_us);
  const bool by_gps = long_enough(&gps_no_, gps, now_us - in.gps_age_us, now_us);
  holds_ = by_pitot || by_gps;
}

}  // namespace core
