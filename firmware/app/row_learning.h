// What a row teaches while it is flown: samples of the identification frames, a solve each second
// in slices, and each derivative as a frame. Decisions and arithmetic are core/learning's. Memory
// is lent (row_memory.h); what is not needed at once stays in the EEPROM.
#pragma once

#include <stdint.h>

#include "core/learning/equation_error.h"
#include "core/learning/fourier_sums.h"

namespace app {

class Outlet;

class RowLearning {
 public:
  // Nothing is learned until `start`.
  void stop() { task_ = Task::kNone; }
  // A row begins. The first step looks at the card.
  void start(uint8_t row, uint16_t rate_hz) {
    row_ = row;
    every_ = static_cast<uint8_t>(rate_hz / core::kSampleHz);
    enough_ = false;
    task_ = Task::kLoad;
  }
  // Each identification frame: of every second or fourth the values are kept for the next step.
  void see(const frames::IdentFrame& ident) {
    if (task_ > Task::kLoad && ++frames_ >= every_) keep(ident);
  }
  // Whether a step has something to do.
  bool ready() const {
    switch (task_) {
      case Task::kNone:
        return false;
      case Task::kWait:
        return due_ != 0 || sums_.count() >= solve_count_ + core::kSampleHz;
      case Task::kSolve:
        return due_ != 0 || slices_ != 0;
      case Task::kDerive:
        // One for each sample: the radio has no room for all at once.
        return due_ != 0 || told_ != static_cast<uint8_t>(sums_.count());
      default:
        return true;
    }
  }
  // In turns of the main loop that do little else, where it is ready: one sample, one slice of a
  // solve, one derivative or one frame, each below 0.3 ms. By its name a test on the chip finds it.
  __attribute__((noinline)) void step(Outlet& outlet, uint32_t now_us);
  // Every half-width that is wanted is small enough.
  bool enough() const { return enough_; }

 private:
  enum class Task : uint8_t { kNone, kLoad, kWait, kSolve, kDerive, kTell };

  static constexpr uint8_t kFirstSolveS = 2;
  // Behind each sample, so that the host can repeat a solve bit by bit: 183 are over within 0.8 s,
  // and there are turns enough for them at 200 Hz too.
  static constexpr uint8_t kSlicesPerSample = 5;

  bool load();
  void keep(const frames::IdentFrame& ident);
  void derive();
  void next_signal();
  void tell(Outlet& outlet);

  core::AxisCard card_;
  core::FourierSums sums_;
  core::EquationError solver_;
  core::LearnedDerivative found_;
  uint32_t solve_us_;
  uint16_t solve_count_;
  int16_t values_[core::kMostSignals];
  uint8_t due_;    // samples to be taken: of a frame that came too soon the one before counts twice
  uint8_t every_;  // so many frames are a sample
  uint8_t frames_;  // since the last
  uint8_t row_;
  uint8_t axis_;    // its number on the card
  uint8_t signal_;  // derived next, or told
  uint8_t slices_;  // that may go on before the next sample
  uint8_t told_;    // low byte of the samples, when one was told last
  bool all_enough_;
  bool enough_;
  Task task_;
};

}  // namespace app
