#include "core/recording.h"

namespace core {
namespace {

constexpr uint32_t kDebounceUs = 30000;
constexpr uint32_t kStopUs = 2000000;
constexpr uint32_t kThrottleUs = 1000000;

}  // namespace

RecordAction RecordControl::update(const PilotInputs& in,
                                   bool recording,
                                   bool auto_start,
                                   uint32_t now_us) {
  throttle_seen_ = throttle_seen_ || in.throttle_valid;
  const bool may_stop = in.throttle_valid ? in.throttle_idle : !throttle_seen_;
  const RecordAction pressed = button(in.button_down, recording, may_stop, now_us);
  const bool high = in.throttle_valid && !in.throttle_idle;
  if (high && !throttle_high_) {
    throttle_us_ = now_us;
  }
  throttle_high_ = high;
  if (pressed != RecordAction::kNone) {
    return pressed;
  }
  const bool starts = auto_start && !recording && high && now_us - throttle_us_ >= kThrottleUs;
  return starts ? RecordAction::kStartThrottle : RecordAction::kNone;
}

RecordAction RecordControl::button(bool raw_down, bool recording, bool may_stop, uint32_t now_us) {
  if (raw_down != raw_down_) {
    raw_down_ = raw_down;
    changed_us_ = now_us;
  }
  if (raw_down != down_ && now_us - changed_us_ >= kDebounceUs) {
    down_ = raw_down;
    return down_ ? press(recording, now_us) : let_go(recording, now_us);
  }
  if (down_ && recording && !spent_ && may_stop && now_us - pressed_us_ >= kStopUs) {
    spent_ = true;
    return RecordAction::kStop;
  }
  return RecordAction::kNone;
}

RecordAction RecordControl::press(bool recording, uint32_t now_us) {
  pressed_us_ = now_us;
  pressed_ = true;
  spent_ = !recording;  // the press that starts does not go on to stop
  return recording ? RecordAction::kNone : RecordAction::kStartButton;
}

RecordAction RecordControl::let_go(bool recording, uint32_t now_us) {
  if (!pressed_) {
    return RecordAction::kNone;  // down since boot
  }
  const uint32_t held_us = now_us - pressed_us_;
  const uint32_t held_ms = held_us / 1000;
  press_ms_ = held_ms > 0xFFFF ? uint16_t{0xFFFF} : static_cast<uint16_t>(held_ms);
  const bool mark = recording && !spent_ && held_us < kStopUs;
  return mark ? RecordAction::kMark : RecordAction::kNone;
}

uint16_t RecordControl::take_press_ms() {
  const uint16_t press_ms = press_ms_;
  press_ms_ = 0;
  return press_ms;
}

BootAction BootControl::update(
    const PilotInputs& in, bool start_pressed, FlightState flight, bool moves, uint32_t now_us) {
  const bool high = in.throttle_valid && !in.throttle_idle;
  if (resume_ || start_pressed || high || flight == FlightState::kFlying) {
    return BootAction::kResume;
  }
  if (flight == FlightState::kGround) {
    return BootAction::kClose;
  }
  if (moves && !doubt_) {
    doubt_ = true;
    doubt_us_ = now_us;
  }
  return doubt_ && now_us - doubt_us_ >= kDoubtUs ? BootAction::kResume : BootAction::kWait;
}

}  // namespace core
