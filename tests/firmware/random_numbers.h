// Numbers that look random and are the same on every computer and chip. (Numerical Recipes' linear
// congruential generator: its upper bits are the good ones.)
#pragma once

#include <stdint.h>

inline uint32_t next_random(uint32_t& state) {
  state = state * 1664525U + 1013904223U;
  return state;
}

class Random {
 public:
  explicit Random(uint32_t seed) : state_(seed) {}
  uint8_t byte() { return static_cast<uint8_t>(next_random(state_) >> 24); }
  uint16_t below(uint16_t limit) {
    return static_cast<uint16_t>((next_random(state_) >> 16) % limit);
  }

 private:
  uint32_t state_;
};
