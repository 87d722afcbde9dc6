#include "core/rc_decoder.h"

namespace core {
namespace {

// The last channel of a sequential receiver shifts by this much when four sticks move at once.
constexpr uint32_t kShiftTicks = 4500UL * kTicksPerUs;

// Early pulses in a row, of all channels, without one frame of a known length between them.
constexpr uint8_t kMaxEarly = 12;

// In 256 ticks, fewer than this are not more than kFreshTicks, whatever their lower bytes.
constexpr uint16_t kYoung = RcDecoder::kFreshTicks / 256U - 1U;

void set(uint8_t& mask, uint8_t bit, bool on) {
  mask = static_cast<uint8_t>(on ? mask | bit : mask & ~bit);
}

}  // namespace

void RcDecoder::edge(uint32_t t_ticks, uint8_t levels, bool late) {
  if (!started_) {
    // Which lines moved is not known: each counts as having just fallen.
    started_ = true;
    levels_ = levels;
    for (Input& input : inputs_) {
      input.fall = t_ticks;
    }
    return;
  }
  uint8_t changed = levels ^ levels_;
  levels_ = levels;
  // A shift by a variable is a loop on the AVR: the bit goes along. Mostly one has changed.
  uint8_t bit = 1;
  for (uint8_t i = 0; changed != 0 && i < kRcInputs; ++i, bit = static_cast<uint8_t>(bit << 1)) {
    if ((changed & bit) == 0) {
      continue;
    }
    changed = static_cast<uint8_t>(changed ^ bit);
    if ((levels & bit) != 0) {
      rise(inputs_[i], bit, t_ticks, late);
    } else {
      fall(inputs_[i], bit, t_ticks, late);
    }
  }
}

void RcDecoder::rise(Input& input, uint8_t bit, uint32_t t_ticks, bool late) {
  const uint32_t low_ticks = t_ticks - input.fall;
  if (input.candidate != 0) {
    settle(input, bit, low_ticks);
  }
  if (!late && low_ticks < kLowBeforeTicks) {
    count_fast(t_ticks - input.rise);
  }
  input.rise = t_ticks;
  set(trusted_, bit, !late && low_ticks >= kLowBeforeTicks);
}

void RcDecoder::count_fast(uint32_t period_ticks) {
  if (period_ticks < kMinWidthTicks || period_ticks > kMaxWidthTicks + kLowBeforeTicks) {
    return;
  }
  fast_ticks_ = static_cast<uint16_t>(period_ticks);
  if (fast_pulses_ < kRefusedPulses) {
    ++fast_pulses_;
  }
}

void RcDecoder::fall(Input& input, uint8_t bit, uint32_t t_ticks, bool late) {
  const uint32_t width_ticks = t_ticks - input.rise;
  const bool trusted = (trusted_ & bit) != 0 && !late;
  set(trusted_, bit, false);
  input.fall = t_ticks;
  if (!trusted || width_ticks < kMinWidthTicks || width_ticks > kMaxWidthTicks) {
    reject(input, bit);
    return;
  }
  if (input.width != 0) {
    const uint32_t locked_ticks = static_cast<uint32_t>(frame_us_) * kTicksPerUs;
    const uint32_t least_ticks = locked_ && locked_ticks > kMinPeriodTicks + kShiftTicks
                                     ? locked_ticks - kShiftTicks
                                     : kMinPeriodTicks;
    if (input.rise - input.accepted < least_ticks) {
      // Perhaps the receiver has become faster: measure its frame time anew.
      if (++early_ > kMaxEarly) {
        locked_ = false;
      }
      reject(input, bit);
      return;
    }
  }
  input.candidate = static_cast<uint16_t>(width_ticks);
  set(waiting_, bit, true);
}

void RcDecoder::settle(Input& input, uint8_t bit, uint32_t low_ticks) {
  if (low_ticks < kLowAfterTicks) {
    reject(input, bit);
    return;
  }
  const uint32_t period_ticks = input.rise - input.accepted;
  const bool first_of_frame = (valid_ & static_cast<uint8_t>(bit - 1)) == 0;
  if (input.width != 0 && first_of_frame && period_ticks >= kMinPeriodTicks &&
      period_ticks <= kMaxPeriodTicks) {
    measure_frame(static_cast<uint16_t>(period_ticks / kTicksPerUs));
  }
  ++changes_;
  fast_pulses_ = 0;
  input.accepted = input.rise;
  input.width = input.candidate;
  input.candidate = 0;
  set(waiting_, bit, false);
  if (input.streak < kSteadyPulses) {
    ++input.streak;
  }
  set(valid_, bit, true);
  set(fresh_, bit, true);
  set(steady_, bit, input.streak >= kSteadyPulses);
}

void RcDecoder::measure_frame(uint16_t period_us) {
  early_ = 0;
  if (!locked_) {
    locked_ = true;
    frame_us_ = period_us;
    return;
  }
  const int16_t change_us = static_cast<int16_t>(period_us - frame_us_);
  frame_us_ = static_cast<uint16_t>(frame_us_ + change_us / 8);
}

void RcDecoder::reject(Input& input, uint8_t bit) {
  input.candidate = 0;
  set(waiting_, bit, false);
  if (glitches_ != 0xFFFF) {
    ++glitches_;
  }
}

void RcDecoder::gap() {
  started_ = false;
  trusted_ = 0;
  waiting_ = 0;
  for (Input& input : inputs_) {
    input.candidate = 0;
  }
}

void RcDecoder::storm() {
  gap();
  uint8_t bit = 1;
  for (Input& input : inputs_) {
    lose(input, bit);
    bit = static_cast<uint8_t>(bit << 1);
  }
}

void RcDecoder::lose(Input& input, uint8_t bit) {
  ++changes_;
  input.width = 0;
  input.streak = 0;
  set(valid_, bit, false);
  set(fresh_, bit, false);
  set(steady_, bit, false);
  if (valid_ == 0) {
    frame_us_ = 0;
    locked_ = false;
  }
}

void RcDecoder::poll(uint32_t now_ticks) {
  if (waiting_ != 0) {
    confirm(now_ticks);
  }
  if (now_ticks - aged_ticks_ < kAgeTicks) {
    return;
  }
  aged_ticks_ = now_ticks;
  const uint16_t now_middle = static_cast<uint16_t>(now_ticks >> 8U);
  uint8_t bit = 1;
  for (uint8_t i = 0; i < kRcInputs; ++i, bit = static_cast<uint8_t>(bit << 1)) {
    Input& input = inputs_[i];
    if (input.width == 0) {
      continue;
    }
    // Most are young, which two bytes of each time tell.
    const uint16_t middle_age = static_cast<uint16_t>(now_middle - middle(input.accepted));
    if (middle_age < kYoung) {
      continue;
    }
    const uint32_t age_ticks = now_ticks - input.accepted;
    if (age_ticks > kLostTicks) {
      lose(input, bit);
      continue;
    }
    if (age_ticks > kUnsteadyTicks && (steady_ & bit) != 0) {
      set(steady_, bit, false);
      ++changes_;
    }
    if (age_ticks > kFreshTicks && (fresh_ & bit) != 0) {
      set(fresh_, bit, false);
      ++changes_;
    }
  }
}

void RcDecoder::confirm(uint32_t now_ticks) {
  uint8_t bit = 1;
  for (uint8_t i = 0; i < kRcInputs; ++i, bit = static_cast<uint8_t>(bit << 1)) {
    // An edge in the ring that is younger than now_ticks settles its pulse itself, next turn.
    if ((waiting_ & bit) != 0 && (levels_ & bit) == 0) {
      const uint32_t low_ticks = now_ticks - inputs_[i].fall;
      if (low_ticks >= kLowAfterTicks) {
        settle(inputs_[i], bit, low_ticks);
      }
    }
  }
}

}  // namespace core
