// Flying or on the ground: decided from all there is, for what only the ground allows (the card's
// directory and its FAT are written there). Once a second each of five witnesses says moving, still
// or nothing:
//
//   witness   moving                                           still            nothing
//   throttle  above idle for the whole second                  -                idle, or not heard
//   airspeed  a pitot above its zero by 60 Pa (10 m/s);        below            open or shorted
//             by 120 Pa (14 m/s) before it saw the ground
//   GPS       faster than 3 m/s over ground, with a fix        slower           no fix, lost
//   pressure  8 Pa (0.7 m) from one second's mean to the next  less             lost
//   IMU       2 deg/s or 0.06 g from end to end of the second  less, 25 deg/s   lost
//             or a mean beyond 25 deg/s                        at most
//
// An idle throttle is no witness of the ground (a glide), a silent receiver neither (it boots for 1
// to 3 s). The mark that a reset leaves is one more witness of motion, for 8 s.
//
//   who says moving     who says still    for     then
//   two or more         anybody           1 s     flying
//   none                two or more       5 s     ground
//   none                one or none       18 s    ground
//   one                 one or more       18 s    ground: one sensor is stuck, or a hand moves us
//   one                 none              ever    as before: nobody speaks against it
//   anything else, and before any of these        in doubt
//
// Flying and ground stay until another line holds; on the ground one witness of motion changes
// nothing. So no sensor alone holds "flying" for more than 18 s. An aircraft that stands still is
// on the ground 5 to 7 s after power-on, 18 s with any one sensor stuck, 26 s if a mark is left
// too.
#pragma once

#include <stdint.h>

namespace core {

enum class FlightState : uint8_t { kInDoubt, kGround, kFlying };  // as frames.toml numbers them

constexpr uint8_t kPitots = 2;

struct AirborneInputs {
  // As in the frame `ident`; original packets have a quarter of the counts per deg/s.
  int16_t rates[3];
  int16_t force[3];
  bool imu;  // it is heard
  bool imu_original;
  uint16_t pitot[kPitots];  // sums of four conversions, 1.22 Pa each
  uint8_t pitots;           // bit per pitot: neither open nor shorted
  bool gps;                 // heard, with a fix
  uint16_t ground_speed_cmps;
  uint32_t static_pressure;  // 1/16 Pa; 0: none
  bool throttle_valid;
  bool throttle_idle;
};

class Airborne {
 public:
  static constexpr uint32_t kSecondUs = 1000000;
  static constexpr uint8_t kStillS = 5;   // nobody moves, two say still
  static constexpr uint8_t kAloneS = 18;  // at most one moves
  static constexpr uint8_t kMarkS = 8;
  static constexpr uint16_t kPitotZero = 2048;   // MPXV7002: half the supply
  static constexpr uint16_t kPitotOffset = 205;  // 6.25 % of 4 V, its band of error
  static constexpr uint16_t kPitotMoving = 50;   // 61 Pa
  static constexpr uint16_t kPitotUntared = 100;
  static constexpr uint16_t kTaxiCmps = 300;
  static constexpr uint16_t kPressureMoving = 128;  // 8 Pa; the noise of a mean is 1 Pa
  static constexpr int16_t kRateSpread = 131;       // as RestDetector, 2 deg/s
  static constexpr int16_t kForceSpread = 500;
  static constexpr int16_t kMostRate = 1638;

  // At boot. `flight_mark`: a reset, not a power-on, ended a recording.
  void start(bool flight_mark, uint32_t now_us);
  // Every 10 ms or so, at least twice a second.
  FlightState step(const AirborneInputs& in, uint32_t now_us);

  FlightState state() const { return state_; }
  bool moves() const { return moving_ != 0; }  // somebody said so in the last second

 private:
  static constexpr uint8_t kMoreSamples = 250;

  void gather(const AirborneInputs& in);
  void judge(const AirborneInputs& in);
  void tare(const AirborneInputs& in);
  void judge_pressure();
  void judge_imu();
  void vote(bool moving);
  void decide(const AirborneInputs& in);
  void begin_second();

  uint32_t second_us_ = 0;      // this second began
  uint32_t pressure_sum_ = 0;   // of this second
  uint32_t pressure_mean_ = 0;  // of the last; 0: none
  int16_t least_[6] = {};
  int16_t most_[6] = {};
  uint16_t pitot_zero_[kPitots] = {kPitotZero, kPitotZero};
  uint8_t imu_samples_ = 0;
  uint8_t pressure_samples_ = 0;
  uint8_t pitot_samples_ = 0;  // with a pitot that can be used
  uint8_t fast_samples_ = 0;   // of those, above the limit
  uint8_t samples_ = 0;
  uint8_t high_samples_ = 0;  // throttle above idle
  uint8_t moving_ = 0;        // witnesses, of the last second
  uint8_t still_ = 0;
  uint8_t still_s_ = 0;  // nobody moves
  uint8_t alone_s_ = 0;  // one moves at most
  uint8_t mark_s_ = 0;   // the mark still speaks for so long
  bool tared_ = false;
  bool original_ = false;
  FlightState state_ = FlightState::kInDoubt;
};

}  // namespace core
