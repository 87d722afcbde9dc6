#include "app/pilot_link.h"

#include "hal/panel.h"
#include "hal/relay.h"
#include "hal/servo_output.h"
#include "hal/system.h"

namespace app {

void PilotLink::start() {
  hal::start_pulse_capture();
  (void)hal::relay_engaged();  // its pull-up wants a microsecond before it is believed
  lost_edges_ = hal::lost_edges();
}

void PilotLink::look(const frames::ConfigFrame& config,
                     bool self_test_passed,
                     TestInputs& inputs,
                     Outlet& outlet,
                     uint32_t now_us) {
  bool polls = due(inputs, now_us);
  hal::Edge edge;
  while (hal::take_edge(&edge)) {
    decoder_.edge(core::extend_ticks(hal::now_ticks(), edge.at_ticks), edge.levels, edge.late);
    polls = polls || decoder_.waiting();
  }
  if (!polls) return;
  polled_us_ = now_us;
  poll_receiver(outlet, now_us);
  uint16_t rest_us = inputs.running() ? kInputRestUs : kRestUs;
  if (drive_.drive() == frames::Drive::kMegaHolding) rest_us = kHoldingRestUs;
  if (inputs.running() && may_be_silent(now_us)) {
    look_for_silence(now_us);
    if (silent_us_ > most_silent_us()) rest_us = 0;
  }
  if (now_us - decided_us_ >= rest_us || decoder_.changes() != decided_changes_) {
    decided_us_ = now_us;
    decided_changes_ = decoder_.changes();
    decide(config, self_test_passed, inputs, outlet, now_us);
  }
}

void PilotLink::poll_receiver(Outlet& outlet, uint32_t now_us) {
  if (hal::lost_edges() != lost_edges_) {
    lost_edges_ = hal::lost_edges();
    decoder_.gap();
  }
  const uint8_t storm = hal::edge_storm();
  if (storm != 0) {
    decoder_.storm();
    if (!stormy_) outlet.event(frames::Event::kReceiverStorm, storm, now_us);
  }
  stormy_ = storm != 0;
  decoder_.poll(hal::now_ticks());
}

void PilotLink::decide(const frames::ConfigFrame& config,
                       bool self_test_passed,
                       TestInputs& inputs,
                       Outlet& outlet,
                       uint32_t now_us) {
  core::map_channels(decoder_, config, channels_);
  if (!drive_.relay()) look_at_contact(now_us);
  drive_.update(channels_, config, self_test_passed && !contact_stuck_, now_us);
  if (inputs.enabled()) look_for_silence(now_us);
  inputs.decide(
      channels_, decoder_, silent_us_, drive_.drive(), self_test_passed, config, outlet, now_us);
  send(inputs, outlet);
  report(outlet, now_us);
}

void PilotLink::send(TestInputs& inputs, Outlet& outlet) {
  for (uint8_t servo = 0; servo < core::kServos; ++servo) {
    const uint16_t ticks = inputs.servo_ticks(servo, drive_.servo_ticks(servo), outlet);
    if (ticks == sent_ticks_[servo]) continue;
    sent_ticks_[servo] = ticks;
    hal::set_servo_pulse(servo, ticks);
  }
}

// Part of the self-test: before the first edge, and some time after the last, the contact is open.
void PilotLink::look_at_contact(uint32_t now_us) {
  if (toggled_ && now_us - toggled_us_ < kReleaseUs) return;
  toggled_ = false;
  contact_stuck_ = hal::relay_engaged();
}

// Between two edges: the pump holds the gate for ten times as long.
void PilotLink::watch_relay(Outlet& outlet, uint32_t now_us) {
  if (!drive_.relay() || !toggled_) {
    relay_watch_.rest();
    return;
  }
  const core::RelayFault fault = relay_watch_.look(hal::relay_engaged(), now_us);
  if (fault == core::RelayFault::kNone) return;
  relay_watch_.rest();
  drive_.relay_lost();
  relay_lost_ = true;
  outlet.event(frames::Event::kRelayLost, static_cast<uint32_t>(fault), now_us);
}

void PilotLink::beat(Outlet& outlet, uint32_t now_us) {
  watch_relay(outlet, now_us);
  if (!health_.beat(now_us)) return;
  hal::feed_watchdog();
  if (!drive_.relay()) return;
  hal::toggle_heartbeat();
  toggled_ = true;
  toggled_us_ = now_us;
}

void PilotLink::report(Outlet& outlet, uint32_t now_us) {
  const uint8_t missing = drive_.missing();
  if (missing != told_missing_) {
    if (missing == 0) {
      outlet.event(frames::Event::kReceiverFound, decoder_.frame_us(), now_us);
    } else if ((missing & ~told_missing_) != 0) {
      outlet.event(frames::Event::kReceiverLost, missing, now_us);
    }
    told_missing_ = missing;
  }
  const bool refused = decoder_.refused_hz() != 0;
  if (refused && !told_refused_) {
    outlet.event(frames::Event::kReceiverRefused, decoder_.refused_hz(), now_us);
  }
  told_refused_ = refused;
  if (drive_.relay()) relay_lost_ = false;
  if (drive_.drive() != told_drive_) {
    told_drive_ = drive_.drive();
    outlet.event(frames::Event::kDriveChanged, static_cast<uint32_t>(told_drive_), now_us);
  }
}

core::PilotInputs PilotLink::inputs(const frames::ConfigFrame& config) const {
  core::PilotInputs in;
  in.button_down = hal::button_pressed();
  in.throttle_valid = (channels_.steady & (1U << core::kThrottle)) != 0;
  in.throttle_idle = channels_.width_ticks[core::kThrottle] <=
                     static_cast<uint32_t>(config.throttle_idle_max_us) * core::kTicksPerUs;
  return in;
}

}  // namespace app
