// One sampling instant of the IMU's gyro and accelerometer.
#pragma once

#include <stdint.h>

namespace core {

struct ImuRawSample {
  // Body axes, nothing taken off; 65.5 LSB per deg/s, 8192 LSB per g (specific force).
  int16_t rates[3];
  int16_t force[3];
  int16_t temperature_cdegc;  // 0.01 degC
  bool gyro_saturated;
  bool accel_saturated;
};

}  // namespace core
