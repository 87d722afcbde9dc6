// The filter against its equations in floating point, step by step, through random motion.
#ifndef __AVR__

#include <math.h>

#include "check.h"
#include "core/imu/attitude.h"
#include "random_numbers.h"

namespace {

using core::Attitude;
using core::AttitudeInput;
using core::AttitudeSettings;

constexpr double kRadPerDeg = 3.14159265358979 / 180.0;
constexpr double kRadpsPerLsb = kRadPerDeg / 65.5;
constexpr double kLsbPerG = 8192.0;
constexpr double kMostBias_radps = 5.0 * kRadPerDeg;  // from the rest's
constexpr double kMostRest_radps = 1638 / 65.5 * kRadPerDeg;

double within(double value, double most) {
  return fmax(-most, fmin(most, value));
}

struct Three {
  double x = 0.0, y = 0.0, z = 0.0;
};

Three operator+(const Three& a, const Three& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
Three operator*(const Three& a, double by) {
  return {a.x * by, a.y * by, a.z * by};
}
Three cross(const Three& a, const Three& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Three limited(const Three& a, double most) {
  return {within(a.x, most), within(a.y, most), within(a.z, most)};
}

// Mahony's filter with a quaternion: gravity and heading steer the rates and teach the bias.
struct Equations {
  explicit Equations(const AttitudeSettings& given) : settings(given) {}

  const AttitudeSettings& settings;
  double w = 1.0;
  Three v;
  Three correction, last_rate, bias, rest_bias, force_sum;
  double heading_error = 0.0;
  double passed_s = 0.0, speed_left_s = 0.0, field_left_s = 0.0;
  double speed_mps = 0.0;
  double phi = 0.0, theta = 0.0, psi = 0.0;
  int settle = Attitude::kSettleSteps, recover = Attitude::kSettleSteps;
  int samples = 0;
  double turning = 0.0;  // LSB
  bool saturated = false, started = false, at_rest = false, rested = false;

  static void turn(double& w, Three& v, const Three& half) {
    const double w0 = w;
    w -= v.x * half.x + v.y * half.y + v.z * half.z;
    v = v + half * w0 + cross(v, half);
  }
  void normalise() {
    const double more = (1.0 - (w * w + v.x * v.x + v.y * v.y + v.z * v.z)) / 2.0;
    w += w * more;
    v = v + v * more;
  }
  static Three down(double w, const Three& v) {
    return {2.0 * (v.x * v.z - w * v.y),
            2.0 * (v.y * v.z + w * v.x),
            1.0 - 2.0 * (v.x * v.x + v.y * v.y)};
  }

  void step(const AttitudeInput& in, double dt_s) {
    dt_s = fmax(0.001, fmin(0.04, dt_s));
    const Three measured = {double(in.rates[0]), double(in.rates[1]), double(in.rates[2])};
    const Three rate = measured * kRadpsPerLsb + bias * -1.0;
    if (!started) last_rate = rate;
    started = true;
    if (in.gyro_saturated) recover = Attitude::kRecoverSteps;
    force_sum = force_sum + Three{double(in.force[0]), double(in.force[1]), double(in.force[2])};
    saturated = saturated || in.accel_saturated;
    passed_s += dt_s;
    turning = fabs(measured.y) + fabs(measured.z);
    const Three mean = (last_rate + rate) * 0.5 + correction;
    last_rate = rate;
    turn(w, v, mean * (0.5 * dt_s));
    if (dt_s > 0.01) normalise();
    put_angles(rate);
    if (++samples == 4) {
      correct();
      samples = 0;
      passed_s = 0.0;
      saturated = false;
      force_sum = Three{};
    }
  }

  void put_angles(const Three& rate) {
    double w1 = w;
    Three v1 = v;
    turn(w1, v1, rate * (0.5e-6 * settings.filter_delay_us));
    const Three d = down(w1, v1);
    phi = atan2(d.y, d.z) / kRadPerDeg;
    theta = atan2(-d.x, sqrt(d.y * d.y + d.z * d.z)) / kRadPerDeg;
    psi = atan2(2.0 * (v1.x * v1.y + w1 * v1.z), 1.0 - 2.0 * (v1.y * v1.y + v1.z * v1.z)) /
          kRadPerDeg;
  }

  void correct() {
    normalise();
    const Three d = down(w, v);
    // Down as felt, in g: omega x (V, 0, 0) minus specific force.
    const double per_radps = speed_mps / 9.80665;
    const Three felt = Three{0.0, last_rate.z * per_radps, -last_rate.y * per_radps} +
                       force_sum * (-0.25 / kLsbPerG);
    const double most = fmax(fabs(felt.x), fmax(fabs(felt.y), fabs(felt.z)));
    double weight = 0.0;
    Three error;
    if (most * kLsbPerG < 37000.5) {
      const double size = sqrt(felt.x * felt.x + felt.y * felt.y + felt.z * felt.z);
      const double off = fabs(size - 1.0) * kLsbPerG + (speed_mps == 0.0 ? 4.0 * turning : turning);
      weight = saturated ? 0.0 : fmax(0.0, 1.0 - off / 4096.0);
      error = cross(felt, d);
    }
    if (weight >= 0.5) {
      settle = settle > 4 ? settle - 4 : 0;
      recover = recover > 4 ? recover - 4 : 0;
    }
    double gain = 1e-3 * settings.tilt_gain_permille;
    double heading_gain = 1e-3 * settings.heading_gain_permille;
    if (settle != 0) {
      gain = heading_gain = 3.0;
    } else if (recover != 0) {
      gain = heading_gain = 0.5;
    }
    Three heading;
    if (field_left_s > 0.0) {
      field_left_s = left(field_left_s);
      heading = d * -heading_error;
    }
    if (speed_left_s > 0.0) {
      speed_left_s = left(speed_left_s);
      if (speed_left_s == 0.0) speed_mps = 0.0;
    }
    if (settle == 0 && recover == 0 && !at_rest) {
      const double learned = 1e-6 * settings.bias_gain_ppm * fmin(passed_s, 0.1);
      bias = near_rest(bias + error * (-learned * weight));
      bias = near_rest(bias + heading * -learned);
    }
    correction = limited(error, 1.0) * (gain * weight) + limited(heading, 1.0) * heading_gain;
  }
  double left(double time_s) const { return time_s > passed_s + 1e-9 ? time_s - passed_s : 0.0; }

  void set_speed(double mps) {
    speed_mps = mps;
    speed_left_s = 1.0;
  }
  void set_field(const int16_t (&field)[3]) {
    const double x = field[0], y = field[1], z = field[2];
    const double north = x * (1.0 - 2.0 * (v.y * v.y + v.z * v.z)) +
                         y * 2.0 * (v.x * v.y - w * v.z) + z * 2.0 * (v.x * v.z + w * v.y);
    const double east = x * 2.0 * (v.x * v.y + w * v.z) +
                        y * (1.0 - 2.0 * (v.x * v.x + v.z * v.z)) + z * 2.0 * (v.y * v.z - w * v.x);
    const double error_deg = atan2(east, north) / kRadPerDeg - 0.01 * settings.declination_cdeg;
    heading_error = remainder(error_deg, 360.0) * kRadPerDeg;
    field_left_s = 0.5;
  }
  void set_rest_rates(const int16_t (&rates)[3]) {
    const Three seen = {double(rates[0]), double(rates[1]), double(rates[2])};
    const Three rest = limited(seen * kRadpsPerLsb, kMostRest_radps);
    if (!rested) rest_bias = rest;
    rested = true;
    bias = near_rest(rest);
  }
  Three near_rest(const Three& learned) const {
    return rest_bias + limited(learned + rest_bias * -1.0, kMostBias_radps);
  }
};

double apart_deg(double a, int16_t b_cdeg) {
  return fabs(remainder(a - 0.01 * b_cdeg, 360.0));
}

}  // namespace

TEST_CASE("every step, through a minute of random motion, is what the equations say") {
  uint32_t random = 46;
  double worst_deg = 0.0;
  double worst_bias_lsb = 0.0;
  double squares_deg2 = 0.0, squares_lsb2 = 0.0;
  uint32_t count = 0;
  uint32_t apart = 0;  // a weight of one half may be seen on either side
  for (uint8_t flight = 0; flight < 12; ++flight) {
    AttitudeSettings settings;
    settings.declination_cdeg = static_cast<int16_t>(flight * 3000 - 16500);
    settings.tilt_gain_permille = static_cast<uint16_t>(50 + 70 * flight);
    settings.heading_gain_permille = static_cast<uint16_t>(900 - 60 * flight);
    settings.bias_gain_ppm = static_cast<uint16_t>(1000 + 5000 * flight);
    settings.filter_delay_us = static_cast<uint16_t>(1000 * flight);
    Attitude attitude(settings);
    Equations equations(settings);
    double amplitude[3], frequency[3], felt[3];
    for (uint32_t at = 0; at < 12000; ++at) {
      if (at % 1500 == 0) {
        for (uint8_t axis = 0; axis < 3; ++axis) {
          // Calm, so that much is learned, in every other piece.
          amplitude[axis] = (next_random(random) % 4000) / (at % 3000 == 0 ? 20.0 : 1.0);
          frequency[axis] = 0.0002 * (1 + next_random(random) % 100);
          felt[axis] = int32_t(next_random(random) % 5000) - 2500.0;
        }
      }
      AttitudeInput in;
      for (uint8_t axis = 0; axis < 3; ++axis) {
        in.rates[axis] =
            static_cast<int16_t>(amplitude[axis] * sin(frequency[axis] * at) + 60.0 * (axis - 1));
        in.force[axis] =
            static_cast<int16_t>(felt[axis] * cos(0.003 * at) - (axis == 2 ? 8000 : 0));
      }
      in.gyro_saturated = at == 5000 && flight % 3 == 0;
      in.accel_saturated = at % 997 < 2;
      // Now and then a push beyond what is taken for gravity.
      if (at % 701 < 4) in.force[at % 3] = at % 2 == 0 ? 32000 : -32000;
      const uint32_t dt_us = at % 50 == 7    ? 12000
                             : at % 211 == 0 ? 300
                             : at % 307 == 0 ? 55000
                                             : 5000;
      if (at % 2400 < 1200 && at % 40 == 0) {
        const uint16_t speed_cmps = static_cast<uint16_t>(800 + next_random(random) % 2000);
        attitude.set_speed(speed_cmps);
        equations.set_speed(0.01 * speed_cmps);
      }
      if (at % 3000 < 2000 && at % 20 == 3) {
        const int16_t field[3] = {static_cast<int16_t>(400 * cos(0.001 * at)),
                                  static_cast<int16_t>(400 * sin(0.001 * at)),
                                  static_cast<int16_t>(300 - 100 * flight)};
        attitude.set_field(field);
        equations.set_field(field);
      }
      if (at == 7000 || at == 9000) {
        const int16_t means[3] = {static_cast<int16_t>(30 * flight), -500, 17};
        attitude.set_rest_rates(means);
        equations.set_rest_rates(means);
        attitude.set_at_rest(true);
        equations.at_rest = true;
      }
      if (at == 7600 || at == 9100) {
        attitude.set_at_rest(false);
        equations.at_rest = false;
      }
      attitude.step(in, dt_us);
      attitude.catch_up();
      equations.step(in, 1e-6 * dt_us);
      const bool steep =
          fabs(equations.theta) > 70.0;  // where roll and heading turn into each other
      const double offs_deg[3] = {
          apart_deg(equations.theta, attitude.theta_cdeg()),
          steep ? 0.0 : apart_deg(equations.phi, attitude.phi_cdeg()),
          steep ? 0.0 : apart_deg(equations.psi, attitude.psi_cdeg()),
      };
      const double biases_radps[3] = {equations.bias.x, equations.bias.y, equations.bias.z};
      for (uint8_t axis = 0; axis < 3; ++axis) {
        const double off_lsb = fabs(biases_radps[axis] / kRadpsPerLsb - attitude.bias(axis));
        worst_deg = fmax(worst_deg, offs_deg[axis]);
        worst_bias_lsb = fmax(worst_bias_lsb, off_lsb);
        squares_deg2 += offs_deg[axis] * offs_deg[axis];
        squares_lsb2 += off_lsb * off_lsb;
        ++count;
      }
      apart += attitude.valid() != (equations.recover == 0);
      REQUIRE(attitude.heading_valid() == (equations.field_left_s > 0.0));
    }
  }
  CHECK(worst_deg < 0.4);
  CHECK(worst_bias_lsb < 2.2);  // of which the LSB that is told is one
  CHECK(sqrt(squares_deg2 / count) < 0.036);
  CHECK(sqrt(squares_lsb2 / count) < 0.65);
  CHECK(apart <= 10);
}

TEST_CASE("left and right, up and down are alike: mirrored forces give mirrored angles") {
  for (int16_t push = 1; push <= 60; ++push) {
    for (uint8_t axis = 0; axis < 2; ++axis) {
      int16_t angle_cdeg[2] = {};
      for (uint8_t side = 0; side < 2; ++side) {
        const AttitudeSettings settings;
        Attitude attitude(settings);
        AttitudeInput in;
        in.force[axis] = static_cast<int16_t>(side == 0 ? push : -push);
        in.force[2] = -8192;
        for (uint16_t at = 0; at < 1600; ++at) {
          attitude.step(in, 5000);
          attitude.catch_up();
        }
        angle_cdeg[side] = axis == 0 ? attitude.theta_cdeg() : attitude.phi_cdeg();
      }
      REQUIRE(angle_cdeg[0] == -angle_cdeg[1]);
      // A slope is its angle: 8192 LSB a g.
      const double slope_cdeg = (axis == 0 ? 100.0 : -100.0) * atan(push / 8192.0) / kRadPerDeg;
      REQUIRE(fabs(angle_cdeg[0] - slope_cdeg) < 1.1);
    }
  }
}

TEST_CASE("a heading error counts for half a second of samples, to the microsecond") {
  for (uint32_t less_us = 0; less_us < 2; ++less_us) {
    const AttitudeSettings settings;
    Attitude attitude(settings);
    AttitudeInput in;
    in.force[2] = -8192;
    const int16_t field[3] = {400, 30, 200};
    attitude.set_field(field);
    for (uint8_t at = 0; at < 100; ++at) {
      CHECK(attitude.heading_valid());
      attitude.step(in, at == 9 ? 5000 - less_us : 5000);
      attitude.catch_up();
    }
    CHECK_EQ(attitude.heading_valid(), less_us != 0);
  }
}

#endif
