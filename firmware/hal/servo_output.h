// Servo pulses from timers with buffered compare registers: they need no CPU once set.
#pragma once

#include <stdint.h>

namespace hal {

constexpr uint8_t kServoOutputs = 4;         // aileron, elevator, rudder, throttle
constexpr uint16_t kServoPeriodUs = 20000U;  // one pulse per period on each output

// Width of the pulses of one output from its next period on, in 0.5 us; 0: no pulses. A pulse under
// way is never cut or stretched. Before the first call the pin is an input. Main loop only.
void set_servo_pulse(uint8_t output, uint16_t width_ticks);

}  // namespace hal
