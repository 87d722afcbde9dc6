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
                        const core::AxisCard& card,
                        const core::DerivativeWorth* worth_flash,
                        uint16_t count) {
  CHECK_EQ(count, expected.count);
  uint8_t enough = 0;
  for (uint8_t s = 0; s < core::signals_of(card.axis); ++s) {
    const core::LearnedDerivative one =
        found.derivative(card, core::flash_load(&worth_flash[s]), s);
    CHECK_EQ(bits_of(one.estimate), expected.estimate[s]);
    CHECK_EQ(bits_of(one.half_width), expected.half_width[s]);
    enough = static_cast<uint8_t>(enough | (one.enough ? 1U << s : 0U));
  }
  CHECK_EQ(enough, expected.enough);
}

inline void run(const core::AxisCard* card_flash,
                const core::DerivativeWorth* worth_flash,
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
        check_solve(core::flash_load(&solves[solved]), solver, card, worth_flash, sums.count());
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
              const core::DerivativeWorth* worth,
              const int16_t* rows,
              uint16_t samples,
              const cases::Solve (&solves)[kSolves],
              const int32_t* sums) {
  run(card, worth, rows, samples, solves, static_cast<uint8_t>(kSolves), sums);
}

}  // namespace replay
