// Registers of the gyro and accelerometer beside the IMU's processor, over SPI. The IMU's board
// only, main loop only.
#pragma once

#include <stdint.h>

namespace hal {

void start_sensor_spi();

// Both end in time, 15 us a byte at most, and read 0xFF from a line without a chip.
void read_sensor(uint8_t reg, uint8_t* out, uint8_t size);
void write_sensor(uint8_t reg, uint8_t value);

}  // namespace hal
