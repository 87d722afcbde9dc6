// The data-ready line of the IMU's gyro and accelerometer. The IMU's board only.
#pragma once

#include <stdint.h>

namespace hal {

void start_data_ready();

// True when there was an edge since the last call: the instant of the last one, by the clock of
// now_us(), and how many there were. Main loop only.
bool take_data_ready(uint32_t& at_us, uint8_t& edges);

// Ends the sleep at an instant at most 32 ms away, once. Main loop only.
void wake_at(uint32_t at_us);

}  // namespace hal
