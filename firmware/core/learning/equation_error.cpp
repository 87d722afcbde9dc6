#include "core/learning/equation_error.h"

#include <string.h>

#include "core/progmem.h"

namespace core {
namespace {

constexpr uint8_t kProductsAtOnce = 5;
// Of a column's sum of squares, what those before it must leave: single floats have 2e-7.
constexpr float kLeastLeft = 1e-5F;
// 2 pi 50 / 512: of a harmonic's number, its frequency in rad/s.
constexpr float kRadps = 0.61359232F;

// 1000 times Student's t, two-sided 95 %, of 1 to 18 degrees of freedom; more are those.
constexpr uint8_t kMostFreedom = 18;
constexpr uint16_t kStudent[kMostFreedom] CORE_FLASH = {12706,
                                                        4303,
                                                        3182,
                                                        2776,
                                                        2571,
                                                        2447,
                                                        2365,
                                                        2306,
                                                        2262,
                                                        2228,
                                                        2201,
                                                        2179,
                                                        2160,
                                                        2145,
                                                        2131,
                                                        2120,
                                                        2110,
                                                        2101};

float squared(const Complex& z) {
  const float re = z.re * z.re;
  const float im = z.im * z.im;
  return re + im;
}

// Real part of conj(a) b.
float inner(const Complex& a, const Complex& b) {
  const float re = a.re * b.re;
  const float im = a.im * b.im;
  return re + im;
}

void add_scaled(Complex& to, float factor, const Complex& from) {
  const float re = factor * from.re;
  const float im = factor * from.im;
  to.re += re;
  to.im += im;
}

// Two integers rest where the two floats will be.
ComplexSum whole(const Complex& at) {
  ComplexSum sum;
  memcpy(&sum, &at, sizeof(sum));
  return sum;
}

Complex as_float(const ComplexSum& sum) {
  return {static_cast<float>(sum.re), static_cast<float>(sum.im)};
}

// Transform of the derivative: j w times that of the signal, and its end.
Complex derivative_of(const Complex& x, int16_t last, const Rotation& turned, float radps) {
  const Complex end = as_float({share_of(last, turned.re) * int32_t{kSampleHz},
                                share_of(last, turned.im) * int32_t{kSampleHz}});
  const float re = radps * x.im;
  const float im = radps * x.re;
  return {end.re - re, end.im + im};
}

// The number of an advance, of a signal that is no rate: the angle's, or a surface's.
uint8_t advance_of(LearningAxis axis, uint8_t signal) {
  return signal == 0 ? uint8_t{0}
                     : static_cast<uint8_t>(signal - (axis == LearningAxis::kPitch ? 1 : 2));
}

// Packed by columns of the upper triangle; the column behind the regressors is the moment.
uint8_t place(uint8_t row, uint8_t column) {
  const uint8_t low = row < column ? row : column;
  const uint8_t high = row < column ? column : row;
  return static_cast<uint8_t>(high * (high + 1U) / 2U + low);
}

}  // namespace

int32_t millionths(float value) {
  constexpr float kMost = 2147.0F;
  constexpr int32_t kMostMillionths = 2147000000;
  if (value >= kMost) return kMostMillionths;
  if (!(value > -kMost)) return -kMostMillionths;
  return static_cast<int32_t>(value * 1e6F);
}

float* EquationError::entry(uint8_t row, uint8_t column) {
  return &entries_[place(row, column)];
}

float EquationError::solved(uint8_t row, uint8_t column) const {
  return entries_[place(row, column)];
}

void EquationError::start(const AxisCard& card) {
  signals_ = signals_of(card.axis);
  memset(entries_, 0, sizeof(entries_));
  residual_ = 0.0F;
  harmonic_ = 0;
  dropped_ = 0;
  solved_ = false;
  task_ = Task::kRow;
}

bool EquationError::step(const AxisCard& card, const FourierSums& sums) {
  switch (task_) {
    case Task::kIdle:
      return false;
    case Task::kRow:
      take_row(card, sums);
      break;
    case Task::kSignal:
      make_signal(card);
      break;
    case Task::kProducts:
      add_products(card);
      break;
    case Task::kPivot:
      choose_pivot();
      break;
    case Task::kSweep:
      sweep_row();
      break;
    case Task::kSwept:
      end_pivot();
      break;
    case Task::kResidual:
      take_residual(card);
      break;
    case Task::kInfluence:
      add_influence(card);
      break;
  }
  return task_ == Task::kIdle;
}

// The sums of one harmonic at one instant, as integers. The newest sample counts half:
// the trapezoidal rule.
void EquationError::take_row(const AxisCard& card, const FourierSums& sums) {
  const uint8_t harmonic = card.harmonics[harmonic_];
  row_step_ = FourierSums::step(harmonic, sums.count());
  const Rotation turned = rotation(row_step_);
  for (uint8_t s = 0; s < signals_; ++s) {
    row_last_[s] = sums.last(s);
    ComplexSum sum = sums.at(harmonic_, s);
    sum.re -= share_of(row_last_[s], turned.re) >> 1;
    sum.im -= share_of(row_last_[s], turned.im) >> 1;
    memcpy(&row_[s], &sum, sizeof(sum));
  }
  moment_ = {0.0F, 0.0F};
  first_ = 0;
  task_ = Task::kSignal;
}

// One signal's integers become its column: its sensor's delay undone, the angle moved to the CG.
void EquationError::make_signal(const AxisCard& card) {
  const uint8_t s = first_;
  const Rotation turned = rotation(row_step_);
  const float radps = kRadps * static_cast<float>(card.harmonics[harmonic_]);
  Complex x = as_float(whole(row_[s]));
  const Complex rate = derivative_of(x, row_last_[s], turned, radps);
  if (is_rate(card.axis, s)) {
    if (s == moment_rate(card.axis)) {
      moment_.re += rate.re;
      moment_.im += rate.im;
    } else {
      add_scaled(moment_, -card.product, rate);
    }
  } else {
    const uint8_t a = advance_of(card.axis, s);
    const float curvature = card.curvature_s2[a] * radps;
    const Complex across = {-rate.im, rate.re};
    add_scaled(x, card.advance_s[a], rate);
    add_scaled(x, curvature, across);
  }
  if (s == 0) {
    add_scaled(x, card.lever, as_float(whole(row_[lever_rate(card.axis)])));
  }
  row_[s] = x;
  if (++first_ == signals_) {
    first_ = 0;
    second_ = 0;
    task_ = solved_ ? Task::kResidual : Task::kProducts;
  }
}

// `second_` is the column of the triangle, `first_` the row in it.
void EquationError::add_products(const AxisCard& card) {
  for (uint8_t n = 0; n < kProductsAtOnce; ++n) {
    const Complex& left = first_ == signals_ ? moment_ : row_[first_];
    const Complex& right = second_ == signals_ ? moment_ : row_[second_];
    *entry(first_, second_) += inner(left, right);
    if (first_ != second_) {
      ++first_;
      continue;
    }
    first_ = 0;
    if (++second_ > signals_) {
      next_row(card);
      return;
    }
  }
}

void EquationError::next_row(const AxisCard& card) {
  task_ = Task::kRow;
  if (++harmonic_ < card.harmonic_count) {
    return;
  }
  harmonic_ = 0;
  first_ = 0;
  if (solved_) {
    task_ = Task::kIdle;
    return;
  }
  for (uint8_t c = 0; c < signals_; ++c) {
    spread_[c] = *entry(c, c);
  }
  task_ = Task::kPivot;
}

// Goodnight's sweep (The American Statistician 33, 1979): after all pivots the matrix is minus its
// inverse, and the moment's column the solution.
void EquationError::choose_pivot() {
  const uint8_t k = first_;
  if (*entry(k, k) > kLeastLeft * spread_[k]) {
    second_ = 0;
    task_ = Task::kSweep;
    return;
  }
  dropped_ = static_cast<uint8_t>(dropped_ | 1U << k);
  for (uint8_t c = 0; c <= signals_; ++c) {
    *entry(k, c) = 0.0F;
  }
  second_ = signals_;
  task_ = Task::kSwept;
}

void EquationError::sweep_row() {
  const uint8_t k = first_;
  const uint8_t row = second_;
  if (row != k) {
    const float factor = *entry(row, k) / *entry(k, k);
    for (uint8_t c = row; c <= signals_; ++c) {
      if (c != k) {
        const float less = factor * *entry(c, k);
        *entry(row, c) -= less;
      }
    }
  }
  if (++second_ > signals_) {
    task_ = Task::kSwept;
  }
}

void EquationError::end_pivot() {
  const uint8_t k = first_;
  if ((dropped_ & 1U << k) == 0) {
    const float inverse = 1.0F / *entry(k, k);
    for (uint8_t c = 0; c <= signals_; ++c) {
      *entry(k, c) *= inverse;
    }
    *entry(k, k) = -inverse;
  }
  task_ = Task::kPivot;
  if (++first_ == signals_) {
    memset(spread_, 0, sizeof(spread_));
    solved_ = true;
    task_ = Task::kRow;
  }
}

void EquationError::take_residual(const AxisCard& card) {
  for (uint8_t c = 0; c < signals_; ++c) {
    add_scaled(moment_, -*entry(c, signals_), row_[c]);
  }
  // Kept as its square: nothing else is asked of it.
  moment_.re = squared(moment_);
  residual_ += moment_.re;
  first_ = 0;
  next_influence(card);
}

// What this harmonic's residual moves one derivative by.
void EquationError::add_influence(const AxisCard& card) {
  Complex moved = {0.0F, 0.0F};
  for (uint8_t c = 0; c < signals_; ++c) {
    add_scaled(moved, -*entry(first_, c), row_[c]);
  }
  const float by = moment_.re * squared(moved);
  spread_[first_] += by;
  ++first_;
  next_influence(card);
}

// Of the derivatives that are wanted.
void EquationError::next_influence(const AxisCard& card) {
  task_ = Task::kInfluence;
  while (first_ < signals_ && (card.told >> first_ & 1U) == 0) {
    ++first_;
  }
  if (first_ == signals_) {
    next_row(card);
  }
}

LearnedDerivative EquationError::derivative(const AxisCard& card,
                                            const DerivativeWorth& worth,
                                            uint8_t signal) const {
  uint8_t freedom = static_cast<uint8_t>(2 * card.harmonic_count);
  for (uint8_t c = 0; c < signals_; ++c) {
    freedom = static_cast<uint8_t>(freedom - ((dropped_ >> c & 1U) == 0 ? 1 : 0));
  }
  const bool told = (card.told >> signal & 1U) != 0 && (dropped_ >> signal & 1U) == 0;
  // More columns than lines: the count has gone below zero and wrapped.
  if (!told || freedom == 0 || freedom > 2 * kMostHarmonics) {
    return {0.0F, 0.0F, false};
  }
  const uint8_t t = freedom < kMostFreedom ? freedom : kMostFreedom;
  const float student = static_cast<float>(flash_u16(&kStudent[t - 1])) * 0.001F;
  const float mean = residual_ * -solved(signal, signal);
  const float own = static_cast<float>(card.harmonic_count) * spread_[signal];
  const float variance = (mean > own ? mean : own) / static_cast<float>(freedom);
  const float scale = worth.gain * student;
  const float random = scale * scale * variance;
  const float known = worth.tolerance * worth.tolerance;
  const float estimate = worth.gain * solved(signal, signals_);
  const float half_width = __builtin_sqrtf(random + known);
  const float wanted = static_cast<float>(worth.wanted_percent) * 0.01F * estimate;
  return {estimate, half_width, half_width <= (wanted < 0.0F ? -wanted : wanted)};
}

}  // namespace core
