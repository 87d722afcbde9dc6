#include "core/input_command.h"

#include "core/test_input.h"
#include "generated/settings.h"

namespace core {
namespace {

using frames::InputEnd;

constexpr uint16_t kUsPerMs = 1000;
// 2^32 / 500 000, cut off: ticks of 0.5 us at a rate in us per second, as a product. A division
// takes 600 cycles.
constexpr uint16_t kRateShare = static_cast<uint16_t>((1ULL << 32U) * kTicksPerUs / 1000000U);
constexpr uint8_t kFrameShare = 8;  // the frame time may drift by an eighth

bool all_channels(const RcChannels& rc) {
  return rc.steady == (1U << kChannels) - 1U;
}

}  // namespace

uint16_t ticks_at(uint16_t rate_usps, uint16_t rest_us) {
  const uint32_t way = static_cast<uint32_t>(rate_usps) * rest_us >> 16U;
  return static_cast<uint16_t>(static_cast<uint32_t>(static_cast<uint16_t>(way)) * kRateShare >>
                               16U);
}

int16_t towards(int16_t from, int16_t to, uint16_t most) {
  const int32_t way = static_cast<int32_t>(to) - from;
  if (way > most) return static_cast<int16_t>(from + most);
  return way < -static_cast<int32_t>(most) ? static_cast<int16_t>(from - most) : to;
}

SwitchPlace switch_place(uint16_t width_ticks,
                         uint16_t switch_mega_min_us,
                         uint16_t switch_armed_min_us) {
  if (switch_armed_min_us == 0 || width_ticks < switch_mega_min_us * kTicksPerUs) {
    return SwitchPlace::kOther;
  }
  if (width_ticks >= switch_armed_min_us * kTicksPerUs) return SwitchPlace::kArmed;
  const uint16_t mega_max_us =
      static_cast<uint16_t>(switch_armed_min_us - settings::kLeastSwitchGapUs);
  return width_ticks <= mega_max_us * kTicksPerUs ? SwitchPlace::kMega : SwitchPlace::kBetween;
}

bool InputCommand::trigger(SwitchPlace place, bool mega_drives, uint32_t now_us) {
  if (state_ == State::kOff || state_ == State::kRunning) return false;
  if (!mega_drives || place == SwitchPlace::kOther) {
    state_ = State::kWaiting;
    return false;
  }
  if (place == SwitchPlace::kMega) {
    if (state_ != State::kAtMega && state_ != State::kReady) go(State::kAtMega, now_us);
    if (state_ == State::kAtMega && now_us - since_us_ >= kMegaUs) state_ = State::kReady;
    return false;
  }
  if (place == SwitchPlace::kBetween) {
    // On its way; what was counted is not enough yet, or counts no more.
    if (state_ != State::kReady) state_ = State::kSpent;
    return false;
  }
  if (state_ == State::kReady) {
    go(State::kAtArmed, now_us);
  } else if (state_ != State::kAtArmed) {
    state_ = State::kSpent;
  }
  return state_ == State::kAtArmed && now_us - since_us_ >= kArmedUs;
}

InputEnd InputCommand::passes(const InputFacts& facts) {
  if (facts.button) return InputEnd::kButton;
  if (facts.drive != frames::Drive::kMega) return InputEnd::kDrive;
  if (facts.place != SwitchPlace::kArmed) return InputEnd::kSwitch;
  if (!all_channels(*facts.rc)) return InputEnd::kReceiver;
  if (facts.frame_us == 0) return InputEnd::kFrameTime;
  // One and a half frames.
  if (facts.silent_us > facts.frame_us + facts.frame_us / 2U) return InputEnd::kReceiver;
  if (!facts.flying) return InputEnd::kNotFlying;
  if (!facts.supply) return InputEnd::kSupply;
  if (!facts.records) return InputEnd::kRecorder;
  return facts.throttle_idle ? InputEnd::kThrottleIdle : InputEnd::kDone;
}

void InputCommand::start(InputMemory& memory, const InputFacts& facts, uint32_t now_us) {
  for (uint8_t i = 0; i < kServos; ++i) memory.stick_ticks[i] = facts.rc->width_ticks[i];
  for (uint8_t i = 0; i < kCardAxes; ++i) memory.applied_ticks[i] = 0;
  memory.frame_us = facts.frame_us;
  memory.looked_us = static_cast<uint16_t>(now_us);
  memory.steered_us = static_cast<uint16_t>(now_us);
  memory.elapsed_ms = 0;
  memory.turns = turns_per_ms(memory.row);
  memory.dropped = facts.dropped;
  memory.open_looks = 0;
  go(State::kRunning, now_us);
}

InputEnd InputCommand::keeps(InputMemory& memory, const InputFacts& facts, uint32_t now_us) const {
  const InputEnd why = passes(facts);
  if (why != InputEnd::kDone) return why;
  const uint16_t rest_us = static_cast<uint16_t>(static_cast<uint16_t>(now_us) - memory.looked_us);
  memory.looked_us = static_cast<uint16_t>(now_us);
  if (rest_us > kLateUs) return InputEnd::kLoopLate;
  if (apart(facts.frame_us, memory.frame_us) > memory.frame_us / kFrameShare) {
    return InputEnd::kFrameTime;
  }
  for (uint8_t i = 0; i < kServos; ++i) {
    if (apart(facts.rc->width_ticks[i], memory.stick_ticks[i]) > facts.stick_us * kTicksPerUs) {
      return InputEnd::kStick;
    }
  }
  memory.open_looks = facts.contact ? uint8_t{0} : static_cast<uint8_t>(memory.open_looks + 1U);
  if (memory.open_looks >= kOpenLooks) return InputEnd::kRelay;
  return facts.dropped != memory.dropped ? InputEnd::kDropped : InputEnd::kDone;
}

bool InputCommand::over(const InputMemory& memory, uint32_t now_us) const {
  const uint32_t row_ms = static_cast<uint32_t>(memory.row.quiet_ms) + memory.row.duration_ms;
  return now_us - since_us_ >= row_ms * kUsPerMs;
}

void InputCommand::steer(InputMemory& memory, uint32_t now_us) const {
  uint16_t rest_us = static_cast<uint16_t>(static_cast<uint16_t>(now_us) - memory.steered_us);
  if (rest_us < kSteerUs) return;
  // Counted in whole milliseconds: the time since the trigger is no division of 32 bits.
  uint16_t passed_us = 0;
  for (; rest_us >= kUsPerMs; rest_us = static_cast<uint16_t>(rest_us - kUsPerMs)) {
    passed_us = static_cast<uint16_t>(passed_us + kUsPerMs);
    ++memory.elapsed_ms;
  }
  memory.steered_us = static_cast<uint16_t>(memory.steered_us + passed_us);
  if (memory.elapsed_ms < memory.row.quiet_ms) return;
  const uint16_t most = ticks_at(memory.rate_max_usps, passed_us);
  int16_t target[kCardAxes];
  deflect(memory.row,
          memory.turns,
          static_cast<uint16_t>(memory.elapsed_ms - memory.row.quiet_ms),
          target);
  for (uint8_t axis = 0; axis < kCardAxes; ++axis) {
    if ((held_axes(memory.row) >> axis & 1U) != 0) continue;  // AttitudeHold's
    memory.applied_ticks[axis] = towards(memory.applied_ticks[axis], target[axis], most);
  }
}

void InputCommand::end(uint8_t rows) {
  state_ = State::kSpent;
  ++row_;
  if (row_ >= rows) row_ = 0;
}

uint16_t add_up_to(uint16_t base_ticks, int16_t deflection_ticks, uint16_t most_ticks) {
  const uint16_t out = static_cast<uint16_t>(base_ticks + deflection_ticks);
  const uint16_t most = base_ticks > most_ticks ? base_ticks : most_ticks;
  return out < most ? out : most;
}

uint16_t add_down_to(uint16_t base_ticks, int16_t deflection_ticks, uint16_t least_ticks) {
  const uint16_t out = static_cast<uint16_t>(base_ticks + deflection_ticks);
  const uint16_t least = base_ticks < least_ticks ? base_ticks : least_ticks;
  return out > least ? out : least;
}

}  // namespace core
