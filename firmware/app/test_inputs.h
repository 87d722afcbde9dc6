// The flight card in flight: enabled on the ground, its rows triggered by the switch, watched,
// ended. Decisions are made in core (InputCommand, judge_readings, StickTravel); here values are
// carried. The card stays in the EEPROM: a row and what it needs stand in lent memory while it may
// be flown.
#pragma once

#include <stdint.h>

#include "app/outlet.h"
#include "core/airborne.h"
#include "core/input_command.h"
#include "core/rc_decoder.h"
#include "core/stick_travel.h"

namespace app {

class PilotLink;
class Sensors;

class TestInputs {
 public:
  // Looks at the card anew; whatever was enabled is no more.
  void load(const frames::ConfigFrame& config);
  // It is being written: there is none.
  void unload();

  // Behind each decision of the drive, before its pulses go out.
  void decide(const core::RcChannels& channels,
              const core::RcDecoder& decoder,
              frames::Drive drive,
              bool supply_good,
              const frames::ConfigFrame& config,
              Outlet& outlet,
              uint32_t now_us) {
    if (command_.enabled()) {
      look({&channels, &decoder, drive, supply_good}, config, outlet, now_us);
    }
  }
  // What goes out where the drive lets `base_ticks` through.
  uint16_t servo_ticks(uint8_t servo, uint16_t base_ticks, Outlet& outlet) const {
    return command_.running() ? added(servo, base_ticks, outlet) : base_ticks;
  }
  // Behind the sensors' turn. True: an input ended, its pulses are to be plain at once.
  bool watch(const Sensors& sensors, Outlet& outlet, uint32_t now_us) {
    return command_.uses_memory() && watch_sensors(sensors, outlet, now_us);
  }
  // Every 10 ms or so: the travel shown, the pilot's sign, the card into the log.
  void step_slow(const PilotLink& pilot,
                 const Sensors& sensors,
                 core::FlightState flight,
                 const frames::ConfigFrame& config,
                 Outlet& outlet,
                 uint32_t now_us);

  bool running() const { return command_.running(); }
  // A press that ended an input does nothing else.
  bool button(bool pressed) {
    button_spent_ = button_spent_ && pressed;
    return pressed && !button_spent_;
  }

  uint8_t rows() const { return rows_; }  // 0: no valid card
  bool enabled() const { return command_.enabled(); }
  void hash_was_shown() { hash_shown_ = true; }
  // Beeps to be heard, once: 1 done, else why it ended; 0: none.
  uint8_t take_beeps() {
    const uint8_t beeps = beeps_;
    beeps_ = 0;
    return beeps;
  }

 private:
  struct Pilot {
    const core::RcChannels* channels;
    const core::RcDecoder* decoder;
    frames::Drive drive;
    bool supply_good;
  };

  void look(const Pilot& pilot, const frames::ConfigFrame& config, Outlet& outlet, uint32_t now_us);
  void begin(core::InputMemory* memory,
             const core::InputFacts& facts,
             Outlet& outlet,
             uint32_t now_us);
  frames::InputEnd load_row(core::InputMemory* memory) const;
  bool watch_sensors(const Sensors& sensors, Outlet& outlet, uint32_t now_us);
  void finish(frames::InputEnd why, Outlet& outlet, uint32_t now_us);
  void enable(const Sensors& sensors, Outlet& outlet, uint32_t now_us);
  void tell_card(Outlet& outlet, uint32_t now_us);
  uint16_t added(uint8_t servo, uint16_t base_ticks, Outlet& outlet) const;

  core::InputHome home_;
  core::InputCommand command_;
  core::StickTravel travel_;
  core::HeldSign sign_;
  uint16_t armed_min_us_ = 0;
  frames::InputEnd outside_ = frames::InputEnd::kSensorLost;  // kDone: all limits hold
  uint8_t rows_ = 0;
  uint8_t told_ = 0;  // frames of the card that this session has
  uint8_t beeps_ = 0;
  bool hash_shown_ = false;
  bool button_spent_ = false;
};

}  // namespace app
