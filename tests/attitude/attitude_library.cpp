// The attitude filter of firmware/core as a library for this computer: one call runs it over
// samples.
#include <stdint.h>

#include "core/imu/attitude.h"
#include "core/imu/rest_detector.h"

extern "C" {

// Arrays of `count` samples: rates and force (3 each), speed in cm/s (0: none), field (3; all zero:
// none). `angles` gets phi theta psi in 0.01 deg, `biases` 65.5 LSB per deg/s, `valid` 0 or 1.
void run_attitude(const int16_t* settings,
                  uint32_t count,
                  uint32_t dt_us,
                  const int16_t* rates,
                  const int16_t* force,
                  const uint16_t* speed_cmps,
                  const int16_t* field,
                  int16_t* angles,
                  int16_t* biases,
                  uint8_t* valid) {
  core::AttitudeSettings chosen;
  chosen.declination_cdeg = settings[0];
  chosen.filter_delay_us = static_cast<uint16_t>(settings[1]);
  chosen.tilt_gain_permille = static_cast<uint16_t>(settings[2]);
  chosen.heading_gain_permille = static_cast<uint16_t>(settings[3]);
  chosen.bias_gain_ppm = static_cast<uint16_t>(settings[4]);
  core::Attitude filter(chosen);
  core::RestDetector rest;
  for (uint32_t i = 0; i < count; ++i) {
    core::AttitudeInput in;
    for (uint8_t axis = 0; axis < 3; ++axis) {
      in.rates[axis] = rates[3 * i + axis];
      in.force[axis] = force[3 * i + axis];
      in.gyro_saturated = in.gyro_saturated || in.rates[axis] > 32759 || in.rates[axis] < -32759;
      in.accel_saturated = in.accel_saturated || in.force[axis] > 32759 || in.force[axis] < -32759;
    }
    if (speed_cmps[i] != 0) {
      filter.set_speed(speed_cmps[i]);
    }
    rest.add(in.rates, in.force);
    filter.set_at_rest(rest.at_rest());
    if (rest.take_means()) {
      const int16_t means[3] = {rest.mean_rate(0), rest.mean_rate(1), rest.mean_rate(2)};
      filter.set_rest_rates(means);
    }
    filter.step(in, dt_us);
    filter.catch_up();
    const int16_t seen[3] = {field[3 * i], field[3 * i + 1], field[3 * i + 2]};
    if (seen[0] != 0 || seen[1] != 0 || seen[2] != 0) {
      filter.set_field(seen);
    }
    angles[3 * i] = filter.phi_cdeg();
    angles[3 * i + 1] = filter.theta_cdeg();
    angles[3 * i + 2] = filter.psi_cdeg();
    for (uint8_t axis = 0; axis < 3; ++axis) {
      biases[3 * i + axis] = filter.bias(axis);
    }
    valid[i] = filter.valid() ? 1 : 0;
  }
}

}  // extern "C"
