// The two packets of the original ArduIMU firmware, made from our samples, for loggers that still
// run the original code. Single-precision numbers are put together from integers.
#pragma once

#include <stdint.h>

#include "generated/frames.h"

namespace core {

struct OriginalValues {
  int16_t rates[3];   // 65.5 LSB per deg/s, offsets taken off
  int16_t force[3];   // specific force, 8192 LSB per g; sent with the other sign
  int16_t angles[3];  // phi theta psi, 0.01 deg
};

// 32 bytes each, for addresses 42 and 27. `gps` is as received; no fix sends zeros.
void put_original_first(uint8_t* out, const OriginalValues& values);
void put_original_second(uint8_t* out, const OriginalValues& values, const frames::GpsFrame& gps);

// The bits of the single-precision number nearest to value * 2^-fraction_bits, cut to 24 bits.
uint32_t float32_bits(int32_t value, uint8_t fraction_bits);

}  // namespace core
