// From receiver pulses to servo pulses, and the proof of life that holds the relay.
#pragma once

#include <stdint.h>

#include "app/outlet.h"
#include "app/test_inputs.h"
#include "core/drive.h"
#include "core/health.h"
#include "core/rc_decoder.h"
#include "core/recording.h"
#include "core/relay_watch.h"
#include "hal/clock.h"
#include "hal/pulse_capture.h"

namespace app {

// Parts of the main loop that must all have run before the heartbeat turns over.
enum Task : uint8_t { kTaskPilot, kTaskSensors, kTaskRecorder, kTaskCount };

class PilotLink {
 public:
  void start();
  // Every turn of the main loop, and while the card makes a call wait. Decides anew when a pulse
  // may have been accepted, else every kRestUs; while an input runs every second poll.
  void step(const frames::ConfigFrame& config,
            bool self_test_passed,
            TestInputs& inputs,
            Outlet& outlet,
            uint32_t now_us) {
    ran(kTaskPilot);
    // The rest apart: saving its registers twice a turn, for the one time in four that there is
    // something to do, took 1 % of the chip.
    if (hal::edge_waits() || due(inputs, now_us)) {
      look(config, self_test_passed, inputs, outlet, now_us);
    }
  }
  // The pulses anew, because an input ended.
  void send(TestInputs& inputs, Outlet& outlet);
  // Turns the heartbeat over and feeds the watchdog once every task has run.
  void ran(Task task) { health_.ran(static_cast<uint8_t>(task)); }
  // By its name a test on the chip stops it.
  __attribute__((noinline, noclone)) void beat(Outlet& outlet, uint32_t now_us);

  core::PilotInputs inputs(const frames::ConfigFrame& config) const;
  const core::RcChannels& channels() const { return channels_; }
  const core::RcDecoder& decoder() const { return decoder_; }
  frames::Drive drive() const { return drive_.drive(); }
  uint16_t servo_ticks(uint8_t servo) const { return sent_ticks_[servo]; }  // 0: no pulse
  // The relay's contact says engaged although no heartbeat holds it: it must not be used.
  bool contact_stuck() const { return contact_stuck_; }
  // It did not follow the heartbeat, and has not been engaged since: an alarm.
  bool relay_lost() const { return relay_lost_; }

 private:
  static constexpr uint16_t kPollUs = 3500;  // pulses that stay away show within this
  static constexpr uint16_t kRestUs = 10000;
  // The relay's contact counts as open at the second look, a plain pulse begins up to 20 ms later,
  // and 45 ms are allowed. Polls are 3.5 to 4.5 ms apart: with a look each third poll two looks
  // may take 27 ms, more than the 25 that are left.
  static constexpr uint16_t kInputRestUs = 2 * kPollUs;
  static constexpr uint32_t kReleaseUs = 200000UL;  // by then a contact is open again
  static constexpr uint16_t kHoldingRestUs = 1000;  // a hold ends on time

  bool due(const TestInputs& inputs, uint32_t now_us) const {
    return decoder_.waiting() || now_us - polled_us_ >= kPollUs ||
           (inputs.running() && may_be_silent(now_us));
  }
  // A frame and a half of silence ends an input at once: asked in every turn, to 0.26 ms.
  bool may_be_silent(uint32_t now_us) const {
    const uint8_t since = static_cast<uint8_t>(static_cast<uint8_t>(now_us >> 8U) - oldest_256us_);
    return since >= static_cast<uint8_t>(most_silent_us() >> 8U);
  }
  uint16_t most_silent_us() const {
    const uint16_t frame_us = decoder_.frame_us();
    return static_cast<uint16_t>(frame_us + frame_us / 2U);
  }
  __attribute__((noinline)) void look(const frames::ConfigFrame& config,
                                      bool self_test_passed,
                                      TestInputs& inputs,
                                      Outlet& outlet,
                                      uint32_t now_us);
  void look_at_contact(uint32_t now_us);
  void watch_relay(Outlet& outlet, uint32_t now_us);
  void poll_receiver(Outlet& outlet, uint32_t now_us);
  void decide(const frames::ConfigFrame& config,
              bool self_test_passed,
              TestInputs& inputs,
              Outlet& outlet,
              uint32_t now_us);
  void report(Outlet& outlet, uint32_t now_us);
  void look_for_silence(uint32_t now_us) {
    const uint32_t oldest_us = decoder_.oldest_us(hal::now_ticks());
    silent_us_ = static_cast<uint16_t>(oldest_us > UINT16_MAX ? UINT16_MAX : oldest_us);
    oldest_256us_ = static_cast<uint8_t>((now_us - silent_us_) >> 8U);
  }

  core::RcDecoder decoder_;
  core::DriveControl drive_;
  core::HealthGate health_{kTaskCount};
  core::RelayWatch relay_watch_;
  core::RcChannels channels_ = {};
  uint16_t sent_ticks_[core::kServos] = {};
  uint32_t polled_us_ = 0;
  uint32_t decided_us_ = 0;
  uint32_t toggled_us_ = 0;  // the last heartbeat edge
  uint16_t lost_edges_ = 0;
  frames::Drive told_drive_ = frames::Drive::kDirectBoot;
  uint8_t told_missing_ = (1U << core::kChannels) - 1;
  uint8_t decided_changes_ = 0;
  uint16_t silent_us_ = 0;    // the oldest pulse, as looked for last
  uint8_t oldest_256us_ = 0;  // when it rose
  bool stormy_ = false;
  bool toggled_ = false;  // a heartbeat edge may hold the relay
  bool contact_stuck_ = false;
  bool relay_lost_ = false;
  bool told_refused_ = false;
};

}  // namespace app
