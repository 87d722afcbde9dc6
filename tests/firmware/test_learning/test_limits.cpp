// What a card may say, each byte of it; half-widths at every number of degrees of freedom.
#include <string.h>

#include "cases.h"
#include "check.h"
#include "core/bytes.h"
#include "core/learning/equation_error.h"
#include "core/learning/fourier_sums.h"
#include "core/progmem.h"
#include "random_numbers.h"

namespace {

using core::LearningAxis;

core::AxisCard pitch() {
  return core::flash_load(&cases::kPitchCard);
}

// A solve of three signals that follow each other with some noise: elevator, rate, angle. `share`:
// of the elevator, what is not the angle's copy.
struct Solved {
  core::AxisCard card = pitch();
  core::FourierSums sums;
  core::EquationError solver;

  explicit Solved(LearningAxis axis = LearningAxis::kPitch, float share = 1.0F) {
    card.axis = axis;
    card.harmonic_count = axis == LearningAxis::kPitch ? 10 : 6;
    card.told = axis == LearningAxis::kPitch ? 7 : 31;
    for (uint8_t i = 0; i < core::kMostHarmonics; ++i) {
      card.harmonics[i] = static_cast<uint8_t>(4 + 3 * i);
    }
    memset(card.advance_s, 0, sizeof(card.advance_s));
    memset(card.curvature_s2, 0, sizeof(card.curvature_s2));
    card.lever = card.product = 0.0F;
    REQUIRE(sums.start(card));
    Random random(17);
    int32_t angle = 0;
    int32_t rate = 0;
    for (uint16_t n = 0; n < 1024; ++n) {
      const int16_t push = static_cast<int16_t>(random.below(2001) - 1000);
      rate += (push * 3 - rate - angle) / 8;
      angle += rate / 8;
      int16_t values[core::kMostSignals];
      values[0] = static_cast<int16_t>(angle);
      values[1] = static_cast<int16_t>(rate);
      values[2] = static_cast<int16_t>(share * static_cast<float>(push) +
                                       (share < 1.0F ? static_cast<float>(angle) * 4.0F : 0.0F));
      values[3] = static_cast<int16_t>(random.below(2001) - 1000);
      values[4] =
          axis == LearningAxis::kRoll ? int16_t{0} : static_cast<int16_t>(random.below(999));
      REQUIRE(sums.take(card, values));
    }
    solver.start(card);
    while (!solver.step(card, sums)) {
    }
  }
  float half_width(uint8_t harmonics, uint8_t signal) const {
    core::AxisCard other = card;
    other.harmonic_count = harmonics;
    return solver.derivative(other, {1.0F, 0.0F, 100}, signal).half_width;
  }
};

bool near(float value, float truth) {
  const float gap = value > truth ? value - truth : truth - value;
  return gap <= 5e-6F * truth;
}

// Student's t, two-sided 95 %, times 1000: as any table has it.
constexpr uint16_t kTable[] = {12706, 4303, 3182, 2776, 2571, 2447, 2365, 2306, 2262, 2228,
                               2201,  2179, 2160, 2145, 2131, 2120, 2110, 2101, 2101, 2101};

// Half-widths of one solve, asked for as if it had fewer harmonics: what is left of them is t.
void check_table(const Solved& one, uint8_t columns, uint8_t signal) {
  const auto freedom = [columns](uint8_t harmonics) {
    return static_cast<uint8_t>(2 * harmonics - columns);
  };
  const uint8_t least = static_cast<uint8_t>(columns / 2 + 1);
  const uint8_t most = static_cast<uint8_t>((20 + columns) / 2);
  const auto variance = [&](uint8_t harmonics) {
    const float width = one.half_width(harmonics, signal);
    const float t = kTable[freedom(harmonics) - 1];
    return width * width * freedom(harmonics) / (t * t);
  };
  // Of the two variances the mean's stays, the sandwich's grows with the number of harmonics.
  const float mean = variance(least);
  const float own = variance(most) / most;
  CHECK(mean > 0.0F);
  for (uint8_t h = least; h <= most; ++h) {
    CHECK(near(variance(h), mean > own * h ? mean : own * h));
  }
  CHECK_EQ(one.half_width(static_cast<uint8_t>(least - 1), signal), 0.0F);
  CHECK_EQ(one.half_width(static_cast<uint8_t>(most + 1), signal), 0.0F);
}

}  // namespace

TEST_CASE("half-widths follow Student's table at each number of degrees of freedom") {
  check_table(Solved(), 3, 1);                     // 1, 3, 5 to 19
  check_table(Solved(LearningAxis::kRoll), 4, 1);  // 2, 4, 6 to 20: the rudder never moved
}

TEST_CASE("a column is told while those before it leave a hundred thousandth of it") {
  CHECK(Solved(LearningAxis::kPitch, 0.3F).half_width(10, 2) > 0.0F);
  CHECK(Solved(LearningAxis::kPitch, 0.05F).half_width(10, 2) > 0.0F);
  CHECK_EQ(Solved(LearningAxis::kPitch, 0.0F).half_width(10, 2), 0.0F);
}

TEST_CASE("enough is the wanted share of the estimate, whatever its sign; the instrument adds") {
  const Solved one;
  for (uint8_t signal = 0; signal < 3; ++signal) {
    for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
      const core::LearnedDerivative told =
          one.solver.derivative(one.card, {1.0F * sign, 0.0F, 100}, signal);
      const float size = told.estimate < 0.0F ? -told.estimate : told.estimate;
      const float share = 100.0F * told.half_width / size;
      for (uint8_t percent = 0; percent < 100; ++percent) {
        const core::LearnedDerivative again =
            one.solver.derivative(one.card, {1.0F * sign, 0.0F, percent}, signal);
        CHECK_EQ(again.enough, share <= percent);
        CHECK_EQ(again.estimate, told.estimate);
      }
      const core::LearnedDerivative twice =
          one.solver.derivative(one.card, {2.0F * sign, 0.0F, 100}, signal);
      CHECK(near(twice.half_width, 2.0F * told.half_width));
      const core::LearnedDerivative known =
          one.solver.derivative(one.card, {1.0F * sign, told.half_width, 100}, signal);
      CHECK(near(known.half_width, 1.4142136F * told.half_width));
    }
  }
  core::AxisCard card = one.card;
  card.told = 5;
  CHECK_EQ(one.solver.derivative(card, {1.0F, 0.0F, 100}, 1).half_width, 0.0F);
  CHECK(one.solver.derivative(card, {1.0F, 0.0F, 100}, 2).half_width > 0.0F);
}

TEST_CASE("a card is good with finite numbers, its own axes and as many sums as there are") {
  for (uint8_t axis = 0; axis < 5; ++axis) {
    for (uint8_t count = 0; count < 13; ++count) {
      for (uint16_t told = 0; told < 256; ++told) {
        core::AxisCard card = pitch();
        card.axis = static_cast<LearningAxis>(axis);
        card.harmonic_count = count;
        card.told = static_cast<uint8_t>(told);
        const bool good = axis == 0   ? count >= 1 && count <= 10 && told < 8
                          : axis <= 2 ? count >= 1 && count <= 6 && told < 32
                                      : false;
        CHECK_EQ(core::axis_good(card), good);
      }
    }
  }
}

TEST_CASE("each single of a card and of its worth may be anything but infinite or no number") {
  const struct {
    uint32_t bits;
    bool finite;
  } cases[] = {{0x7F800000, false},
               {0xFF800000, false},
               {0x7FC00000, false},
               {0x7F800001, false},
               {0x7F7FFFFF, true},
               {0xFF7FFFFF, true},
               {0x80000000, true},
               {0x3F800000, true},
               {0x7F000000, true},
               {0x00800000, true},
               {0x3FFFFFFF, true},
               {0x00FFFFFF, true}};
  for (const auto& one : cases) {
    for (uint8_t single = 0; single < 8; ++single) {
      core::AxisCard card = pitch();
      core::put_le(reinterpret_cast<uint8_t*>(&card) + 13 + 4 * single, one.bits);
      CHECK_EQ(core::axis_good(card), one.finite);
    }
    for (uint8_t single = 0; single < 10; ++single) {
      frames::CardWorthLayout worth = {};
      core::put_le(reinterpret_cast<uint8_t*>(&worth) + 4 * single, one.bits);
      CHECK_EQ(core::worth_good(worth), one.finite);
    }
    // What stands behind the singles is none.
    frames::CardWorthLayout worth = {};
    memset(reinterpret_cast<uint8_t*>(&worth) + 40, 0xFF, sizeof(worth) - 40);
    CHECK(core::worth_good(worth));
  }
}

TEST_CASE("which signals an axis has, which of them are rates, and where its derivatives begin") {
  const LearningAxis axes[] = {LearningAxis::kPitch, LearningAxis::kRoll, LearningAxis::kYaw};
  const frames::Derivative first[] = {
      frames::Derivative::kCmAlpha, frames::Derivative::kClBeta, frames::Derivative::kCnBeta};
  const uint8_t signals[] = {3, 5, 5};
  const uint8_t moments[] = {1, 1, 2};
  const uint8_t levers[] = {1, 2, 2};
  const uint8_t rates[] = {0b00010, 0b00110, 0b00110};
  for (uint8_t i = 0; i < 3; ++i) {
    CHECK_EQ(static_cast<uint8_t>(axes[i]), i);
    CHECK_EQ(core::signals_of(axes[i]), signals[i]);
    CHECK_EQ(core::first_derivative(axes[i]), static_cast<uint8_t>(first[i]));
    CHECK_EQ(core::moment_rate(axes[i]), moments[i]);
    CHECK_EQ(core::lever_rate(axes[i]), levers[i]);
    for (uint8_t s = 0; s < signals[i]; ++s) {
      CHECK_EQ(core::is_rate(axes[i], s), (rates[i] >> s & 1) != 0);
    }
  }
}
