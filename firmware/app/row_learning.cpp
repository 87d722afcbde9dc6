#include "app/row_learning.h"

#include "app/card_store.h"
#include "app/outlet.h"

namespace app {

using core::LearningAxis;

namespace {

uint16_t worth_offset(uint8_t axis, size_t field, uint8_t size, uint8_t signal) {
  const uint16_t part = static_cast<uint16_t>(card_axis_part(axis) + 1U);
  return static_cast<uint16_t>(part * frames::kCardPartBytes + field + size * signal);
}

core::DerivativeWorth worth_of(uint8_t axis, uint8_t signal) {
  using Worth = frames::CardWorthLayout;
  core::DerivativeWorth worth;
  read_card(worth_offset(axis, offsetof(Worth, gain), sizeof worth.gain, signal),
            &worth.gain,
            sizeof worth.gain);
  read_card(worth_offset(axis, offsetof(Worth, tolerance), sizeof worth.tolerance, signal),
            &worth.tolerance,
            sizeof worth.tolerance);
  read_card(worth_offset(axis, offsetof(Worth, wanted_percent), 1, signal),
            &worth.wanted_percent,
            sizeof worth.wanted_percent);
  return worth;
}

int16_t sum(uint16_t a, uint16_t b) {
  return static_cast<int16_t>(a + b);
}

}  // namespace

bool RowLearning::load() {
  axis_ = card_axis_of_row(row_);
  if (axis_ == 0) return false;
  read_card(
      static_cast<uint16_t>(card_axis_part(axis_) * frames::kCardPartBytes), &card_, sizeof card_);
  solve_count_ = static_cast<uint16_t>((kFirstSolveS - 1U) * core::kSampleHz);
  frames_ = static_cast<uint8_t>(every_ - 1U);
  due_ = 0;
  return sums_.start(card_);
}

void RowLearning::keep(const frames::IdentFrame& ident) {
  frames_ = 0;
  ++due_;
  if (card_.axis == LearningAxis::kPitch) {
    values_[0] = sum(ident.alpha_a, ident.alpha_b);
    values_[1] = ident.q;
    values_[2] = static_cast<int16_t>(ident.pot_elevator);
  } else {
    values_[0] = sum(ident.beta_a, ident.beta_b);
    values_[1] = ident.p;
    values_[2] = ident.r;
    values_[3] = static_cast<int16_t>(ident.pot_aileron_left - ident.pot_aileron_right);
    values_[4] = static_cast<int16_t>(ident.pot_rudder);
  }
}

void RowLearning::step(Outlet& outlet, uint32_t now_us) {
  if (task_ == Task::kLoad) {
    task_ = load() ? Task::kWait : Task::kNone;
    return;
  }
  if (due_ != 0) {
    --due_;
    (void)sums_.take(card_, values_);
    slices_ = kSlicesPerSample;
    return;
  }
  switch (task_) {
    case Task::kWait:
      solve_count_ = sums_.count();
      solve_us_ = now_us;
      solver_.start(card_);
      task_ = Task::kSolve;
      return;
    case Task::kSolve:
      --slices_;
      if (!solver_.step(card_, sums_)) return;
      signal_ = 0;
      all_enough_ = true;
      task_ = Task::kDerive;
      return;
    case Task::kDerive:
      told_ = static_cast<uint8_t>(sums_.count());
      derive();
      return;
    default:
      tell(outlet);
      return;
  }
}

void RowLearning::derive() {
  if ((card_.told >> signal_ & 1U) != 0) {
    found_ = solver_.derivative(card_, worth_of(axis_, signal_), signal_);
    all_enough_ = all_enough_ && found_.enough;
    task_ = Task::kTell;
    return;
  }
  next_signal();
}

void RowLearning::next_signal() {
  task_ = Task::kDerive;
  if (++signal_ < core::signals_of(card_.axis)) return;
  enough_ = all_enough_;
  task_ = Task::kWait;
}

void RowLearning::tell(Outlet& outlet) {
  frames::LearnedFrame frame;
  frame.t_us = solve_us_;
  frame.samples = solve_count_;
  frame.row = row_;
  frame.derivative = static_cast<uint8_t>(core::first_derivative(card_.axis) + signal_);
  frame.enough = found_.enough ? 1 : 0;
  frame.estimate = core::millionths(found_.estimate);
  frame.half_width = static_cast<uint32_t>(core::millionths(found_.half_width));
  outlet.put(frame);
  next_signal();
}

}  // namespace app
