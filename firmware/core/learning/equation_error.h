// Equation error of one moment coefficient from running transforms, in slices of at most 0.3 ms.
// The rate's transform times j w is its acceleration's; regressors are angle, rates and surfaces.
// Half-widths count the residual's spectrum: each harmonic weighs with its own residual
// (White's sandwich, Econometrica 48, 1980), and never less than with the mean.
// Software float, outside the recording path: the only part of `core` that has any.
#pragma once

#include <stdint.h>

#include "core/learning/fourier_sums.h"

namespace core {

constexpr uint8_t kMostEntries = (kMostSignals + 1) * (kMostSignals + 2) / 2;

struct Complex {
  float re;
  float im;
};

struct LearnedDerivative {
  float estimate;
  float half_width;  // two-sided 95 %, of residual and instrument; 0: not told
  bool enough;       // at most the wanted share of the estimate
};

// For the log: up to 2147 to either side, further is cut; no number is the least of them.
int32_t millionths(float value);

class EquationError {
 public:
  // Begins a solve; a result that was there is gone.
  void start(const AxisCard& card);
  // One slice. Samples may be taken between any two: each harmonic stands at its own instant.
  // True at the slice that ends the solve.
  bool step(const AxisCard& card, const FourierSums& sums);

  bool idle() const { return task_ == Task::kIdle; }
  // Of the last solve, from its end to the next start; a slice of its own.
  LearnedDerivative derivative(const AxisCard& card,
                               const DerivativeWorth& worth,
                               uint8_t signal) const;

 private:
  enum class Task : uint8_t {
    kIdle,
    kRow,
    kSignal,
    kProducts,
    kPivot,
    kSweep,
    kSwept,
    kResidual,
    kInfluence
  };

  float* entry(uint8_t row, uint8_t column);
  float solved(uint8_t row, uint8_t column) const;
  void take_row(const AxisCard& card, const FourierSums& sums);
  void make_signal(const AxisCard& card);
  void add_products(const AxisCard& card);
  void choose_pivot();
  void sweep_row();
  void end_pivot();
  void take_residual(const AxisCard& card);
  void add_influence(const AxisCard& card);
  void next_influence(const AxisCard& card);
  void next_row(const AxisCard& card);

  float entries_[kMostEntries];  // normal equations, then minus their inverse beside the solution
  float spread_[kMostSignals];   // the diagonal as it was, then the sandwich's
  Complex row_[kMostSignals];    // one harmonic's regressors
  Complex moment_;               // its left side, then its residual
  float residual_;               // sum of squares
  int16_t row_last_[kMostSignals];
  uint16_t row_step_ = 0;
  uint8_t signals_ = 0;
  uint8_t harmonic_ = 0;
  uint8_t first_ = 0;    // where the task is: signal, row of the matrix, pivot
  uint8_t second_ = 0;   // column, row of a sweep
  uint8_t dropped_ = 0;  // columns that are a combination of those before, bit by bit
  bool solved_ = false;
  Task task_ = Task::kIdle;
};

}  // namespace core
