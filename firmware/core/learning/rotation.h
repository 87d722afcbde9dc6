// exp(-j 2 pi step / 512) from a table: the phase of a harmonic is a product of integers, so no
// oscillator drifts and none has a state.
#pragma once

#include <stdint.h>

namespace core {

constexpr uint16_t kTurnSteps = 512;
constexpr int16_t kOneQ12 = 4096;

// Cosine and minus sine, 1 is 4096.
struct Rotation {
  int16_t re;
  int16_t im;
};

// Any step: it wraps at 512, which divides 2^16.
Rotation rotation(uint16_t step);

}  // namespace core
