// What a sample and a slice cost on the chip: at most 0.3 ms of it, 4800 cycles.
#ifdef __AVR__

#include <avr/io.h>

#include "cases.h"
#include "check.h"
#include "core/learning/equation_error.h"
#include "core/learning/fourier_sums.h"

namespace {

constexpr uint16_t kMostCycles = 4800;

struct Costs {
  uint16_t sample = 0;
  uint16_t slice = 0;
  uint32_t solve = 0;
  uint16_t slices = 0;
};

// Timer 1 counts cycles; what the reading itself takes is in the figure.
uint16_t since(uint16_t began) {
  return static_cast<uint16_t>(TCNT1 - began);
}

Costs costs_of(const core::AxisCard* card_flash, const int16_t* rows, uint16_t samples) {
  TCCR1A = 0;
  TCCR1B = _BV(CS10);
  const core::AxisCard card = core::flash_load(card_flash);
  core::FourierSums sums;
  core::EquationError solver;
  Costs most;
  sums.start(card);
  for (uint16_t n = 0; n < samples; ++n) {
    int16_t values[core::kMostSignals];
    core::flash_copy(values, rows + n * sums.signals(), static_cast<uint16_t>(2 * sums.signals()));
    const uint16_t began = TCNT1;
    sums.take(card, values);
    const uint16_t took = since(began);
    most.sample = took > most.sample ? took : most.sample;
  }
  solver.start(card);
  for (bool ended = false; !ended; ++most.slices) {
    const uint16_t began = TCNT1;
    ended = solver.step(card, sums);
    const uint16_t took = since(began);
    most.slice = took > most.slice ? took : most.slice;
    most.solve += took;
  }
  for (uint8_t s = 0; s < sums.signals(); ++s) {
    const core::DerivativeWorth worth = {0.1F, 0.01F, 10};
    const uint16_t began = TCNT1;
    const core::LearnedDerivative one = solver.derivative(card, worth, s);
    const uint16_t took = since(began);
    most.slice = took > most.slice ? took : most.slice;
    most.solve += took;
    CHECK(one.half_width >= 0.0F);
  }
  return most;
}

void check_costs(const Costs& most) {
  CHECK(most.sample <= kMostCycles);
  CHECK(most.slice <= kMostCycles);
  CHECK(most.slices <= 250);
  CHECK(most.solve <= 560000U);
}

}  // namespace

TEST_CASE("pitch: no slice is longer than 0.3 ms") {
  check_costs(costs_of(&cases::kPitchCard, cases::kPitchRows, cases::kPitchSamples));
}

TEST_CASE("roll and yaw: no slice is longer than 0.3 ms") {
  check_costs(costs_of(&cases::kRollCard, cases::kRollRows, cases::kRollSamples));
  check_costs(costs_of(&cases::kYawCard, cases::kYawRows, cases::kYawSamples));
}

#endif
