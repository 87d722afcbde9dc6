#include "app/panel.h"

#include "hal/panel.h"

namespace app {

namespace {

constexpr uint32_t kHalfFlashUs = 200000UL;
constexpr uint32_t kHalfSlowUs = 500000UL;
constexpr uint32_t kHalfFastUs = 100000UL;
constexpr uint8_t kPauseHalves = 10;
constexpr uint32_t kWorkUs = 1000000UL;
constexpr uint32_t kWorkLitUs = 100000UL;
constexpr uint32_t kWorkLitUsPerPercent = 8000UL;
constexpr uint8_t kRelayFlashes = 9;
constexpr uint8_t kQuick = 0x80;

}  // namespace

uint8_t trouble_flashes(Recorder::State state, storage::VolumeStatus status) {
  if (state == Recorder::State::kFailed) return 7;
  if (state == Recorder::State::kFileFull) return 5;
  if (state != Recorder::State::kNoFile) return 0;
  switch (status) {
    case storage::VolumeStatus::kReady:
      return 0;
    case storage::VolumeStatus::kNoCard:
      return 2;
    case storage::VolumeStatus::kNoFat:
      return 3;
    case storage::VolumeStatus::kUnreadable:
      return 4;
    case storage::VolumeStatus::kFull:
      return 5;
    case storage::VolumeStatus::kFragmented:
      return 6;
    case storage::VolumeStatus::kDamaged:
      return 8;
  }
  return 0;
}

void Panel::step(const Recorder& recorder, bool relay_lost, TestInputs& inputs, uint32_t now_us) {
  if (show_input(inputs, now_us)) return;
  const Recorder::State state = recorder.state();
  if (state != shown_) {
    if (state == Recorder::State::kRecording) tones_ = 2;
    if (shown_ == Recorder::State::kRecording) tones_ = 4;
    shown_ = state;
    flash_ = 0;
    turned_us_ = now_us;
    tone_us_ = now_us;
  }
  const uint8_t flashes =
      relay_lost ? kRelayFlashes : trouble_flashes(state, recorder.volume_status());
  const uint32_t since_us = now_us - turned_us_;
  if (flashes > 0) {
    if (since_us >= kHalfFlashUs) {
      turned_us_ = now_us;
      flash_ = static_cast<uint8_t>(flash_ + 1 >= 2 * flashes + kPauseHalves ? 0 : flash_ + 1);
    }
    const bool on = flash_ < 2 * flashes && flash_ % 2 == 0;
    hal::set_led(on);
    hal::set_buzzer(recorder.unrecorded() ? alarm(now_us) : on);
    return;
  }
  if (state == Recorder::State::kReady) {
    hal::set_led(true);
  } else if (state == Recorder::State::kNoFile) {
    if (since_us >= kWorkUs) turned_us_ = now_us;
    hal::set_led(since_us < kWorkLitUs + recorder.percent() * kWorkLitUsPerPercent);
  } else {
    const uint32_t half_us = state == Recorder::State::kRecording ? kHalfSlowUs : kHalfFastUs;
    if (since_us >= half_us) {
      turned_us_ = now_us;
      flash_ ^= 1U;
    }
    hal::set_led(flash_ == 0);
  }
  if (recorder.unrecorded()) {
    hal::set_buzzer(alarm(now_us));
    return;
  }
  sound(now_us);
}

// While one runs, and until its beeps are over, nothing else is heard.
bool Panel::show_input(TestInputs& inputs, uint32_t now_us) {
  const uint8_t beeps = inputs.take_beeps();
  if (beeps != 0) {
    tones_ = static_cast<uint8_t>(kQuick | (2U * beeps + 1U));  // behind a pause
    tone_us_ = now_us;
  }
  if (inputs.running()) {
    const bool on = alarm(now_us) || inputs.learned_enough();
    hal::set_led(on);
    hal::set_buzzer(on);
    return true;
  }
  if ((tones_ & kQuick) == 0) return false;
  if (now_us - tone_us_ >= kHalfFlashUs) {
    tone_us_ = now_us;
    --tones_;
  }
  const bool on = tones_ != kQuick && tones_ % 2 == 0;
  if (tones_ == kQuick) tones_ = 0;
  hal::set_led(on);
  hal::set_buzzer(on);
  return true;
}

bool Panel::alarm(uint32_t now_us) {
  if (now_us - tone_us_ >= kHalfFastUs) {
    tone_us_ = now_us;
    alarm_on_ = !alarm_on_;
  }
  return alarm_on_;
}

void Panel::sound(uint32_t now_us) {
  if (tones_ > 0 && now_us - tone_us_ >= kHalfSlowUs) {
    tone_us_ = now_us;
    --tones_;
  }
  hal::set_buzzer(tones_ > 0 && tones_ % 2 == 0);
}

}  // namespace app
