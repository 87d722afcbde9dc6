// The learning against the host's arithmetic, bit for bit (tests/learning/shared_cases.py).
#include "cases.h"
#include "check.h"
#include "core/learning/equation_error.h"
#include "core/learning/fourier_sums.h"
#include "core/progmem.h"

namespace {

constexpr uint8_t kSlicesPerSample = 23;
constexpr uint16_t kFirstSolve = 100;

uint32_t bits_of(float value) {
  uint32_t bits;
  memcpy(&bits, &value, sizeof(bits));
  return bits;
}

void check_solve(const cases::Solve& expected,
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

// Samples and slices alternate as in shared_cases.py.
void run(const core::AxisCard* card_flash,
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
    core::flash_copy(values, rows + n * signals, static_cast<uint16_t>(2 * signals));
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

}  // namespace

TEST_CASE("pitch, ten harmonics: every bit of the host's") {
  run_case(&cases::kPitchCard,
           cases::kPitchRows,
           cases::kPitchSamples,
           cases::kPitchSolves,
           cases::kPitchSums);
}

TEST_CASE("roll, six harmonics of five signals: every bit of the host's") {
  run_case(&cases::kRollCard,
           cases::kRollRows,
           cases::kRollSamples,
           cases::kRollSolves,
           cases::kRollSums);
}

TEST_CASE("yaw: every bit of the host's") {
  run_case(
      &cases::kYawCard, cases::kYawRows, cases::kYawSamples, cases::kYawSolves, cases::kYawSums);
}

TEST_CASE("an aileron that never moved is not told, the others are") {
  run_case(&cases::kStillCard,
           cases::kStillRows,
           cases::kStillSamples,
           cases::kStillSolves,
           cases::kStillSums);
  const cases::Solve last = core::flash_load(&cases::kStillSolves[0]);
  CHECK_EQ(last.half_width[3], 0U);
  CHECK(last.half_width[0] != 0U);
}

TEST_CASE("a rudder that is the aileron's copy is not told") {
  run_case(&cases::kCopiedCard,
           cases::kCopiedRows,
           cases::kCopiedSamples,
           cases::kCopiedSolves,
           cases::kCopiedSums);
  const cases::Solve last = core::flash_load(&cases::kCopiedSolves[0]);
  CHECK_EQ(last.half_width[4], 0U);
}

TEST_CASE("the largest jumps that 16 bits hold") {
  run_case(&cases::kWildCard,
           cases::kWildRows,
           cases::kWildSamples,
           cases::kWildSolves,
           cases::kWildSums);
}

// A square wave in step with a harmonic is the worst there is: each sample adds all it can.
TEST_CASE("no sum overflows in 60 s, and then nothing is added") {
  core::AxisCard card = core::flash_load(&cases::kPitchCard);
  card.harmonics[0] = 0;  // cosine 1 at every sample
  core::FourierSums sums;
  REQUIRE(sums.start(card));
  const int16_t first[core::kMostSignals] = {INT16_MAX, INT16_MIN, 0, 0, 0};
  const int16_t later[core::kMostSignals] = {INT16_MIN, INT16_MAX, 1, 0, 0};
  REQUIRE(sums.take(card, first));
  for (uint16_t n = 1; n < core::kMostSamples; ++n) {
    REQUIRE(sums.take(card, later));
  }
  CHECK_EQ(sums.at(0, 0).re, INT32_C(-1) * 2999 * (INT32_C(1) << 19));
  CHECK_EQ(sums.at(0, 1).re, INT32_C(2999) * (INT32_C(32767) << 4));
  CHECK(!sums.take(card, first));
  CHECK_EQ(sums.count(), core::kMostSamples);
  CHECK_EQ(sums.at(0, 0).re, INT32_C(-1) * 2999 * (INT32_C(1) << 19));
}

TEST_CASE("a card that wants more sums than there are is refused") {
  core::AxisCard card = core::flash_load(&cases::kRollCard);
  core::FourierSums sums;
  card.harmonic_count = 7;
  CHECK(!sums.start(card));
  card.harmonic_count = 0;
  CHECK(!sums.start(card));
  card.axis = core::LearningAxis::kPitch;
  card.harmonic_count = 11;
  CHECK(!sums.start(card));
  card.harmonic_count = 10;
  CHECK(sums.start(card));
}
