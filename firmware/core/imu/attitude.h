// Attitude from rates, specific force, magnetometer and speed: a quaternion driven by the rates and
// drawn slowly to where gravity and north are seen, learning the gyro bias on the way (Mahony,
// Hamel & Pflimlin, IEEE TAC 53, 2008, explicit form). Fixed point: 200 Hz on an ATmega328P.
#pragma once

#include <stdint.h>

namespace core {

struct AttitudeSettings {
  int16_t declination_cdeg = 413;    // east positive; 4.13 deg is the thesis's field
  uint16_t filter_delay_us = 2800;   // of the gyro's low-pass: angles are carried on by so much
  uint16_t tilt_gain_permille = 80;  // 1/s
  uint16_t heading_gain_permille = 300;
  uint16_t bias_gain_ppm = 1000;  // 1/s2
};

struct AttitudeInput {
  int16_t rates[3] = {};  // 65.5 LSB per deg/s, ground offsets taken off
  int16_t force[3] = {};  // 8192 LSB per g, specific force
  bool gyro_saturated = false;
  bool accel_saturated = false;
};

class Attitude {
 public:
  // Of fast convergence, 3 s at 200 Hz; and behind a saturated gyro, 10 s. Only such count in which
  // gravity was seen: a start or a reset in a steep turn is valid when the turn is over.
  static constexpr uint16_t kSettleSteps = 600;
  static constexpr uint16_t kRecoverSteps = 2000;
  static constexpr uint8_t kSamplesPerCorrection = 4;  // 50 Hz: half the cycles of 200 Hz
  static constexpr uint32_t kSpeedUs = 1000000;        // a speed is used this long
  static constexpr uint32_t kFieldUs = 500000;         // a heading error is worked off this long

  explicit Attitude(const AttitudeSettings& settings) : settings_(settings) {}

  // The sample taken `dt_us` after the last one. Steps of 1 to 40 ms; longer ones are cut.
  void step(const AttitudeInput& in, uint32_t dt_us);
  // Behind every step, when there is time: the correction that every 4th sample asks for, half of a
  // step's cycles. It takes effect with the next step.
  void catch_up();

  // At rest (RestDetector) gravity and field teach no bias: the mean rates of a second do.
  void set_at_rest(bool at_rest) { at_rest_ = at_rest; }
  void set_rest_rates(const int16_t (&rates)[3]);  // as in AttitudeInput
  // True airspeed, else GPS ground speed: takes the turn's own acceleration off. Body axes.
  void set_speed(uint16_t speed_cmps);
  // Magnetic field in body axes, any scale, at the last sample.
  void set_field(const int16_t (&field)[3]);
  void forget_bias();  // offsets were changed

  // 0.01 deg, carried on by the filter's delay.
  int16_t phi_cdeg() const { return phi_cdeg_; }
  int16_t theta_cdeg() const { return theta_cdeg_; }
  int16_t psi_cdeg() const { return psi_cdeg_; }
  // Settled, and not just behind a saturated gyro.
  bool valid() const { return recover_steps_ == 0; }
  // A heading error was seen within the last half second.
  bool heading_valid() const { return field_left_us_ != 0; }
  // As in the packet: 65.5 LSB per deg/s, the learned part only.
  int16_t bias(uint8_t axis) const;

 private:
  struct Vector {
    int32_t x, y, z;
  };
  struct Quaternion {
    int32_t w, x, y, z;  // Q30, north-east-down into body
  };
  static void turn(Quaternion& q, const Vector& half_angle_q30);
  static void normalise(Quaternion& q);
  static Vector down(const Quaternion& q);
  Vector gravity_error(uint16_t& weight) const;
  void learn(const Vector& error_q25, int32_t gain_q28, int32_t dt_k);
  void correct();
  void put_angles(const Vector& rate_q27);

  const AttitudeSettings& settings_;
  Quaternion attitude_ = {INT32_C(1) << 30, 0, 0, 0};
  Vector down_ = {0, 0, INT32_C(1) << 30};  // of attitude_, in body axes
  Vector correction_ = {};                  // Q27 rad/s, held between two corrections
  Vector last_rate_ = {};                   // Q27 rad/s
  int32_t bias_[3] = {};                    // Q30 rad/s
  int32_t rest_bias_[3] = {};               // as the first rest said
  int32_t heading_error_ = 0;               // Q25 rad, positive: heading too large
  int32_t force_sum_[3] = {};
  uint32_t passed_us_ = 0;
  uint32_t speed_left_us_ = 0;
  uint32_t field_left_us_ = 0;
  uint16_t speed_cmps_ = 0;
  uint16_t settle_steps_ = kSettleSteps;
  uint16_t recover_steps_ = kSettleSteps;
  int16_t turning_[2] = {};  // q r of the last sample
  int16_t phi_cdeg_ = 0;
  int16_t theta_cdeg_ = 0;
  int16_t psi_cdeg_ = 0;
  uint8_t samples_ = 0;
  bool accel_saturated_ = false;
  bool started_ = false;
  bool at_rest_ = false;
  bool rested_ = false;
};

}  // namespace core
