// A case of cases.h through the learning: samples and slices alternate as in shared_cases.py.
#pragma once

#include <string.h>

#include "cases.h"
#include "check.h"
#include "core/learning/equation_error.h"
#include "core/learning/fourier_sums.h"
#include "core/progmem.h"

namespace replay {

constexpr uint8_t kSlicesPerSample = 23;
constexpr uint16_t kFirstSolve = 100;

inline uint32_t bits_of(float value) {
  uint32_t bits;
  memcpy(&bits, &value, sizeof(bits));
  return bits;
}

inline void check_solve(const cases::Solve& expected,
                        const core::EquationError& found,
                        uint16_t count,
                        uint8_t signals) {
  CHECK_EQ(count, expected.count);
  for (uint8_t s = 0; s < signals; ++s) {
    CHECK_EQ(bits_of(found.derivative(s).estimate), expected.estimate[s]);
    CHECK_EQ(bits_of(found.derivative(s).half_width), expected.half_width[s]);
  }
  CHECK_EQ(found.enough(), expected.enough);
}

inline void run(const core::AxisCard* card_flash,
                const int16_t* rows,
                uint16_t samples,
                const cases::Solve* solves,
                uint8_t solve_count,
                const int32_t* sums_flash) {
  const core::AxisCard card = core::flash_load(card_flash);
  core::FourierSums sums;
  core::EquationError solver;
  REQUIRE(sums.start(card));
  const uint8_t signals = sums.signals();
  uint8_t solved = 0;
  for (uint16_t n = 0; n < samples; ++n) {
    int16_t values[core::kMostSignals];
    core::flash_copy(
        values, rows + static_cast<uint16_t>(n * signals), static_cast<uint16_t>(2 * signals));
    REQUIRE(sums.take(card, values));
    if (solver.idle() && sums.count() >= kFirstSolve && sums.count() % core::kSampleHz == 0) {
      solver.start(card);
    }
    for (uint8_t i = 0; i < kSlicesPerSample; ++i) {
      if (solver.step(card, sums)) {
        REQUIRE(solved < solve_count);
        check_solve(core::flash_load(&solves[solved]), solver, sums.count(), signals);
        ++solved;
      }
    }
  }
  CHECK_EQ(solved, solve_count);
  for (uint8_t k = 0; k < card.harmonic_count; ++k) {
    for (uint8_t s = 0; s < signals; ++s) {
      const core::ComplexSum sum = sums.at(k, s);
      CHECK_EQ(sum.re, core::flash_load(sums_flash++));
      CHECK_EQ(sum.im, core::flash_load(sums_flash++));
    }
  }
}

template <uint16_t kSolves>
void run_case(const core::AxisCard* card,
              const int16_t* rows,
              uint16_t samples,
              const cases::Solve (&solves)[kSolves],
              const int32_t* sums) {
  run(card, rows, samples, solves, static_cast<uint8_t>(kSolves), sums);
}

}  // namespace replay
