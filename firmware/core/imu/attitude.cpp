#include "core/imu/attitude.h"

#include "core/imu/fixed_point.h"
#include "core/imu/rest_detector.h"

namespace core {
namespace {

constexpr int32_t kOneQ30 = INT32_C(1) << 30;
constexpr int32_t kHalfQ30 = kOneQ30 / 2;  // 1 - 2 (x2 + y2) without its 2, which would not fit
constexpr int32_t kRadpsQ27 = 35764;       // 1/65.5 deg/s in rad/s, Q27
constexpr int16_t kGravity = 8192;
constexpr uint32_t kHalfPerUs = 17180;              // 4e-6 * 2^32: rate Q27 to half an angle Q30
constexpr uint32_t kTurnPerCmps = 4277;             // 16 * 8192 / (980.665 * 2^27) * 2^32
constexpr int32_t kPermilleQ28 = 268435;            // 0.001
constexpr int32_t kPpmQ28 = 268;                    // 1e-6
constexpr int32_t kFastGainQ28 = INT32_C(3) << 28;  // 3 1/s while settling
constexpr int32_t kRecoverGainQ28 = INT32_C(1) << 27;
constexpr int32_t kLearnedLimitQ30 = 93689000;  // 5 deg/s, from what the first rest said
constexpr uint16_t kFullWeight = 4096;
constexpr uint32_t kShortestUs = 1000;
constexpr uint32_t kLongestUs = 40000;
constexpr uint32_t kNormaliseUs = 10000;
constexpr uint32_t kLongestPassedUs = 100000;  // dt_k stays below 2^31

int32_t clamp(int32_t value, int32_t limit) {
  return value > limit ? limit : value < -limit ? -limit : value;
}

uint16_t magnitude(int16_t value) {
  return static_cast<uint16_t>(value < 0 ? -int32_t{value} : int32_t{value});
}

uint16_t less(uint16_t steps) {
  constexpr uint8_t kBy = Attitude::kSamplesPerCorrection;
  return steps > kBy ? static_cast<uint16_t>(steps - kBy) : uint16_t{0};
}

// Error Q25 rad, of which 1 counts at most, times gain Q28 1/s as a rate in Q27. Two of them and
// the gyro's 8.7 rad/s stay below the 16 that Q27 holds.
int32_t rate_of(int32_t error_q25, int32_t gain_q28) {
  constexpr int32_t kMostQ25 = INT32_C(1) << 25;
  return mul_high(clamp(error_q25, kMostQ25), gain_q28) * 64;
}

}  // namespace

// q (1, half angle) to first order: the angle comes out as 2 atan(half), short by its cube over 12,
// 0.08 deg per second at 500 deg/s and 200 Hz.
void Attitude::turn(Quaternion& q, const Vector& h) {
  const Quaternion from = q;
  q.w -= mul_q30(from.x, h.x) + mul_q30(from.y, h.y) + mul_q30(from.z, h.z);
  q.x += mul_q30(from.w, h.x) + mul_q30(from.y, h.z) - mul_q30(from.z, h.y);
  q.y += mul_q30(from.w, h.y) + mul_q30(from.z, h.x) - mul_q30(from.x, h.z);
  q.z += mul_q30(from.w, h.z) + mul_q30(from.x, h.y) - mul_q30(from.y, h.x);
}

void Attitude::normalise(Quaternion& q) {
  const int32_t size =
      mul_q30(q.w, q.w) + mul_q30(q.x, q.x) + mul_q30(q.y, q.y) + mul_q30(q.z, q.z);
  const int32_t more = (kOneQ30 - size) / 2;
  q.w += mul_q30(q.w, more);
  q.x += mul_q30(q.x, more);
  q.y += mul_q30(q.y, more);
  q.z += mul_q30(q.z, more);
}

Attitude::Vector Attitude::down(const Quaternion& q) {
  return Vector{2 * (mul_q30(q.x, q.z) - mul_q30(q.w, q.y)),
                2 * (mul_q30(q.y, q.z) + mul_q30(q.w, q.x)),
                2 * (kHalfQ30 - mul_q30(q.x, q.x) - mul_q30(q.y, q.y))};
}

// Measured x expected direction of down, Q25 rad; its weight by how much it looks like gravity.
Attitude::Vector Attitude::gravity_error(uint16_t& weight) const {
  // Down as felt: the motion's acceleration omega x (V, 0, 0) minus specific force, in 1/16 LSB.
  const int32_t turn_k = static_cast<int32_t>(speed_cmps_ * kTurnPerCmps);
  constexpr int32_t kSixteenths = 16 / kSamplesPerCorrection;
  const int32_t gx = -force_sum_[0] * kSixteenths;
  const int32_t gy = mul_high(last_rate_.z, turn_k) - force_sum_[1] * kSixteenths;
  const int32_t gz = -mul_high(last_rate_.y, turn_k) - force_sum_[2] * kSixteenths;
  const int32_t x = gx / 16;
  const int32_t y = gy / 16;
  const int32_t z = gz / 16;
  constexpr int32_t kMost = 37000;  // three squares still fit 32 bits
  if (x > kMost || x < -kMost || y > kMost || y < -kMost || z > kMost || z < -kMost) {
    weight = 0;
    return Vector{0, 0, 0};
  }
  const uint16_t size = square_root(static_cast<uint32_t>(x * x) + static_cast<uint32_t>(y * y) +
                                    static_cast<uint32_t>(z * z));
  uint32_t off = size > kGravity ? size - kGravity : kGravity - size;
  // A turn is not told from a bank without a speed, and not quite with the ground's: beyond 16
  // deg/s of turning, 62 deg/s with a speed, nothing is learned.
  const uint32_t turning = uint32_t{magnitude(turning_[0])} + magnitude(turning_[1]);
  off += speed_cmps_ == 0 ? turning * 4 : turning;
  weight = off >= kFullWeight || accel_saturated_ ? uint16_t{0}
                                                  : static_cast<uint16_t>(kFullWeight - off);
  constexpr int32_t kToQ27 = 1024;
  const int32_t limit = INT32_MAX / kToQ27;
  const int32_t mx = clamp(gx, limit) * kToQ27;
  const int32_t my = clamp(gy, limit) * kToQ27;
  const int32_t mz = clamp(gz, limit) * kToQ27;
  return Vector{mul_high(my, down_.z) - mul_high(mz, down_.y),
                mul_high(mz, down_.x) - mul_high(mx, down_.z),
                mul_high(mx, down_.y) - mul_high(my, down_.x)};
}

void Attitude::learn(const Vector& error_q25, int32_t gain_q28, int32_t dt_k) {
  // Q25 rad * Q28 1/s2 * s as Q30 rad/s; dt_k is 4 * dt in Q32.
  const int32_t per_step = mul_high(gain_q28, dt_k) * 128;
  const int32_t error[3] = {error_q25.x, error_q25.y, error_q25.z};
  for (uint8_t axis = 0; axis < 3; ++axis) {
    const int32_t learned = bias_[axis] - rest_bias_[axis] - mul_high(error[axis], per_step);
    bias_[axis] = rest_bias_[axis] + clamp(learned, kLearnedLimitQ30);
  }
}

void Attitude::set_rest_rates(const int16_t (&rates)[3]) {
  for (uint8_t axis = 0; axis < 3; ++axis) {
    const int32_t seen = clamp(rates[axis], RestDetector::kMostRate) * kRadpsQ27 * 8;
    // A later one may be a turn without a gust.
    rest_bias_[axis] = rested_ ? rest_bias_[axis] : seen;
    bias_[axis] = rest_bias_[axis] + clamp(seen - rest_bias_[axis], kLearnedLimitQ30);
  }
  rested_ = true;
}

void Attitude::step(const AttitudeInput& in, uint32_t dt_us) {
  catch_up();  // nothing to do, unless there was no time for it
  dt_us = dt_us < kShortestUs ? kShortestUs : dt_us > kLongestUs ? kLongestUs : dt_us;
  const int32_t dt_k = static_cast<int32_t>(dt_us * kHalfPerUs);
  const Vector rate = {in.rates[0] * kRadpsQ27 - bias_[0] / 8,
                       in.rates[1] * kRadpsQ27 - bias_[1] / 8,
                       in.rates[2] * kRadpsQ27 - bias_[2] / 8};
  if (!started_) {
    started_ = true;
    last_rate_ = rate;
  }
  if (in.gyro_saturated) {
    recover_steps_ = kRecoverSteps;
  }
  for (uint8_t axis = 0; axis < 3; ++axis) {
    force_sum_[axis] += in.force[axis];
  }
  accel_saturated_ = accel_saturated_ || in.accel_saturated;
  passed_us_ += dt_us;
  ++samples_;
  turning_[0] = in.rates[1];
  turning_[1] = in.rates[2];

  // The mean of two samples stands for the time between them.
  const Vector mean = {last_rate_.x / 2 + rate.x / 2 + correction_.x,
                       last_rate_.y / 2 + rate.y / 2 + correction_.y,
                       last_rate_.z / 2 + rate.z / 2 + correction_.z};
  last_rate_ = rate;
  turn(attitude_, Vector{mul_high(mean.x, dt_k), mul_high(mean.y, dt_k), mul_high(mean.z, dt_k)});
  // Each turn makes the quaternion longer, by 1.26 at most in a step of 40 ms: four such, and its
  // square would no longer fit.
  if (dt_us > kNormaliseUs) {
    normalise(attitude_);
  }
  put_angles(rate);
}

void Attitude::catch_up() {
  if (samples_ == kSamplesPerCorrection) {
    correct();
    samples_ = 0;
    passed_us_ = 0;
    accel_saturated_ = false;
    force_sum_[0] = force_sum_[1] = force_sum_[2] = 0;
  }
}

void Attitude::correct() {
  normalise(attitude_);
  down_ = down(attitude_);
  uint16_t weight = 0;
  const Vector error = gravity_error(weight);
  if (weight >= kFullWeight / 2) {  // else nothing was seen to settle on, as in a steep turn
    settle_steps_ = less(settle_steps_);
    recover_steps_ = less(recover_steps_);
  }

  int32_t gain = settings_.tilt_gain_permille * kPermilleQ28;
  int32_t heading_gain = settings_.heading_gain_permille * kPermilleQ28;
  if (settle_steps_ != 0) {
    gain = heading_gain = kFastGainQ28;
  } else if (recover_steps_ != 0) {
    gain = heading_gain = kRecoverGainQ28;
  }
  gain = gain / kFullWeight * weight;

  Vector heading = {0, 0, 0};
  if (field_left_us_ != 0) {
    field_left_us_ = field_left_us_ > passed_us_ ? field_left_us_ - passed_us_ : 0;
    // About the vertical: along down, against the error.
    heading = Vector{-mul_q30(down_.x, heading_error_),
                     -mul_q30(down_.y, heading_error_),
                     -mul_q30(down_.z, heading_error_)};
  }
  if (speed_left_us_ != 0) {
    speed_left_us_ = speed_left_us_ > passed_us_ ? speed_left_us_ - passed_us_ : 0;
    speed_cmps_ = speed_left_us_ == 0 ? uint16_t{0} : speed_cmps_;
  }
  const uint32_t passed_us = passed_us_ < kLongestPassedUs ? passed_us_ : kLongestPassedUs;
  const int32_t dt_k = static_cast<int32_t>(passed_us * kHalfPerUs);
  if (settle_steps_ == 0 && recover_steps_ == 0 && !at_rest_) {
    const int32_t bias_gain = settings_.bias_gain_ppm * kPpmQ28;
    learn(error, bias_gain / kFullWeight * weight, dt_k);
    learn(heading, bias_gain, dt_k);
  }
  correction_ = Vector{rate_of(error.x, gain) + rate_of(heading.x, heading_gain),
                       rate_of(error.y, gain) + rate_of(heading.y, heading_gain),
                       rate_of(error.z, gain) + rate_of(heading.z, heading_gain)};
}

void Attitude::put_angles(const Vector& rate) {
  Quaternion q = attitude_;
  const int32_t late_k = static_cast<int32_t>(settings_.filter_delay_us * kHalfPerUs);
  turn(q, Vector{mul_high(rate.x, late_k), mul_high(rate.y, late_k), mul_high(rate.z, late_k)});
  const Vector d = down(q);
  const int32_t y = d.y >> 15;
  const int32_t z = d.z >> 15;
  const uint32_t level = static_cast<uint32_t>(y * y) + static_cast<uint32_t>(z * z);
  phi_cdeg_ = atan2_cdeg(d.y, d.z);
  theta_cdeg_ = atan2_cdeg(-d.x, static_cast<int32_t>(square_root(level)) << 15);
  psi_cdeg_ = atan2_cdeg(2 * (mul_q30(q.x, q.y) + mul_q30(q.w, q.z)),
                         2 * (kHalfQ30 - mul_q30(q.y, q.y) - mul_q30(q.z, q.z)));
}

void Attitude::set_speed(uint16_t speed_cmps) {
  speed_cmps_ = speed_cmps;
  speed_left_us_ = kSpeedUs;
}

void Attitude::set_field(const int16_t (&field)[3]) {
  // Turned into north and east by the present attitude, then compared with the declination.
  const Quaternion& q = attitude_;
  const int32_t m[3] = {
      int32_t{field[0]} * 16384, int32_t{field[1]} * 16384, int32_t{field[2]} * 16384};
  const int32_t north = mul_high(m[0], 2 * (kHalfQ30 - mul_q30(q.y, q.y) - mul_q30(q.z, q.z))) +
                        mul_high(m[1], 2 * (mul_q30(q.x, q.y) - mul_q30(q.w, q.z))) +
                        mul_high(m[2], 2 * (mul_q30(q.x, q.z) + mul_q30(q.w, q.y)));
  const int32_t east = mul_high(m[0], 2 * (mul_q30(q.x, q.y) + mul_q30(q.w, q.z))) +
                       mul_high(m[1], 2 * (kHalfQ30 - mul_q30(q.x, q.x) - mul_q30(q.z, q.z))) +
                       mul_high(m[2], 2 * (mul_q30(q.y, q.z) - mul_q30(q.w, q.x)));
  if (north == 0 && east == 0) {
    return;  // a field straight down says nothing
  }
  int32_t error = int32_t{atan2_cdeg(east, north)} - settings_.declination_cdeg;
  error = error > 18000 ? error - 36000 : error < -18000 ? error + 36000 : error;
  constexpr int32_t kCdegQ25 = 5856;  // 0.01 deg in rad, Q25
  heading_error_ = error * kCdegQ25;
  field_left_us_ = kFieldUs;
}

void Attitude::forget_bias() {
  for (uint8_t axis = 0; axis < 3; ++axis) {
    bias_[axis] = rest_bias_[axis] = 0;
  }
  rested_ = false;
}

int16_t Attitude::bias(uint8_t axis) const {
  return static_cast<int16_t>(bias_[axis] / 8 / kRadpsQ27);
}

}  // namespace core
