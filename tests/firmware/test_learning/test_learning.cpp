// The learning against the host's arithmetic, bit for bit (tests/learning/shared_cases.py).
#include "cases.h"
#include "check.h"
#include "core/learning/equation_error.h"
#include "core/learning/fourier_sums.h"
#include "core/progmem.h"
#include "replay.h"

TEST_CASE("pitch, ten harmonics: every bit of the host's") {
  replay::run_case(&cases::kPitchCard,
                   cases::kPitchWorth,
                   cases::kPitchRows,
                   cases::kPitchSamples,
                   cases::kPitchSolves,
                   cases::kPitchSums);
}

TEST_CASE("roll, six harmonics of five signals: every bit of the host's") {
  replay::run_case(&cases::kRollCard,
                   cases::kRollWorth,
                   cases::kRollRows,
                   cases::kRollSamples,
                   cases::kRollSolves,
                   cases::kRollSums);
}

TEST_CASE("yaw, two derivatives that nobody wants: every bit of the host's") {
  replay::run_case(&cases::kYawCard,
                   cases::kYawWorth,
                   cases::kYawRows,
                   cases::kYawSamples,
                   cases::kYawSolves,
                   cases::kYawSums);
}

TEST_CASE("an aileron that never moved is not told, the others are") {
  replay::run_case(&cases::kStillCard,
                   cases::kStillWorth,
                   cases::kStillRows,
                   cases::kStillSamples,
                   cases::kStillSolves,
                   cases::kStillSums);
  const cases::Solve last = core::flash_load(&cases::kStillSolves[0]);
  CHECK_EQ(last.half_width[3], 0U);
  CHECK(last.half_width[0] != 0U);
}

TEST_CASE("a rudder that is the aileron's copy is not told") {
  replay::run_case(&cases::kCopiedCard,
                   cases::kCopiedWorth,
                   cases::kCopiedRows,
                   cases::kCopiedSamples,
                   cases::kCopiedSolves,
                   cases::kCopiedSums);
  const cases::Solve last = core::flash_load(&cases::kCopiedSolves[0]);
  CHECK_EQ(last.half_width[4], 0U);
}

TEST_CASE("the largest jumps that 16 bits hold") {
  replay::run_case(&cases::kWildCard,
                   cases::kWildWorth,
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

TEST_CASE("a second start begins anew: the same sums as those of a first one") {
  const core::AxisCard card = core::flash_load(&cases::kPitchCard);
  const int16_t rows[][core::kMostSignals] = {
      {5, -3, 200, 0, 0}, {70, 9, -1000, 0, 0}, {-8, 1, 30, 0, 0}};
  core::FourierSums fresh;
  core::FourierSums again;
  REQUIRE(again.start(card));
  REQUIRE(again.take(card, rows[1]));
  REQUIRE(again.take(card, rows[0]));
  REQUIRE(fresh.start(card));
  REQUIRE(again.start(card));
  CHECK_EQ(again.count(), 0);
  for (const auto& row : rows) {
    REQUIRE(fresh.take(card, row));
    REQUIRE(again.take(card, row));
  }
  CHECK_EQ(again.count(), 3);
  for (uint8_t signal = 0; signal < again.signals(); ++signal) {
    CHECK_EQ(again.last(signal), fresh.last(signal));
    CHECK_EQ(again.at(1, signal).re, fresh.at(1, signal).re);
    CHECK_EQ(again.at(1, signal).im, fresh.at(1, signal).im);
  }
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
  CHECK(!sums.start(card));  // a derivative that pitch has not
  card.told = 7;
  CHECK(sums.start(card));
  card.axis = static_cast<core::LearningAxis>(3);
  CHECK(!sums.start(card));
}

TEST_CASE("what the log takes: millionths, cut at both ends") {
  CHECK_EQ(core::millionths(0.0F), 0);
  CHECK_EQ(core::millionths(-1.5F), -1500000);
  CHECK_EQ(core::millionths(0.25F), 250000);
  CHECK_EQ(core::millionths(2147.0F), 2147000000);
  CHECK_EQ(core::millionths(3e30F), 2147000000);
  CHECK_EQ(core::millionths(-3e30F), -2147000000);
  CHECK_EQ(core::millionths(__builtin_nanf("")), -2147000000);
}
