// The flight card in flight: enabled on the ground, its rows triggered by the switch, watched,
// ended. Decisions are made in core (InputCommand, judge_readings, StickTravel); here values are
// carried. The card stays in the EEPROM: a row and what it needs stand in lent memory while it may
// be flown.
#pragma once

#include <stdint.h>

#include "app/outlet.h"
#include "app/row_memory.h"
#include "core/airborne.h"
#include "core/flying_proof.h"
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
              uint16_t silent_us,
              frames::Drive drive,
              bool supply_good,
              const frames::ConfigFrame& config,
              Outlet& outlet,
              uint32_t now_us) {
    if (command_.enabled()) {
      look({&channels, &decoder, silent_us, drive, supply_good}, config, outlet, now_us);
    }
  }
  // What goes out where the drive lets `base_ticks` through.
  uint16_t servo_ticks(uint8_t servo, uint16_t base_ticks, Outlet& outlet) const {
    return command_.running() ? added(servo, base_ticks, outlet) : base_ticks;
  }
  // Behind the sensors' turn, which began at `turn_us`. True: an input ended, its pulses are to be
  // plain at once.
  bool watch(const Sensors& sensors, Outlet& outlet, uint32_t turn_us) {
    return command_.uses_memory() && watch_sensors(sensors, outlet, turn_us);
  }
  // Every 10 ms or so: the travel shown, the pilot's sign, the card into the log.
  void step_slow(const PilotLink& pilot,
                 const Sensors& sensors,
                 core::FlightState flight,
                 const frames::ConfigFrame& config,
                 Outlet& outlet,
                 uint32_t now_us);

  bool running() const { return command_.running(); }
  // In a turn of the main loop of its own. False: there was nothing to do.
  bool learn(Outlet& outlet, uint32_t now_us) {
    if (memory_ == nullptr) return false;
    if (command_.running()) {
      if (!memory_->told) return tell_start(outlet);
      if (memory_->holds || !memory_->learning.ready()) return false;
      memory_->learning.step(outlet, now_us);
      return true;
    }
    return memory_->judged == frames::CardFault::kNotValid && judge(outlet);
  }
  // Of the row that is flown all is known that its card wants.
  bool learned_enough() const {
    return command_.running() && memory_ != nullptr && !memory_->holds &&
           memory_->learning.enough();
  }
  // Whether a row may be flown: `lend` is to give memory for it, null where none may.
  bool wants_memory() const { return command_.uses_memory(); }
  void lend(RowMemory* memory, Outlet& outlet, uint32_t now_us);
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
    uint16_t silent_us;
    frames::Drive drive;
    bool supply_good;
  };

  // By their names a test on the chip finds the slices of an input.
  __attribute__((noinline)) void look(const Pilot& pilot,
                                      const frames::ConfigFrame& config,
                                      Outlet& outlet,
                                      uint32_t now_us);
  void begin(core::InputMemory* memory,
             const core::InputFacts& facts,
             uint16_t rate_hz,
             Outlet& outlet,
             uint32_t now_us);
  bool judge(Outlet& outlet);
  bool tell_start(Outlet& outlet);
  bool news(const Sensors& sensors, const core::InputWatch& watch, uint32_t turn_us) const;
  __attribute__((noinline)) void see(const Sensors& sensors,
                                     core::InputMemory& memory,
                                     uint32_t now_us);
  void load_hold(uint8_t part, uint8_t held, Outlet& outlet);
  bool holds() const { return memory_ != nullptr && memory_->holds; }
  bool tilted(uint8_t axis, const core::RcChannels& rc, const Sensors& sensors) const;
  void prove(uint8_t axis, const core::RcChannels& rc, Outlet& outlet, uint32_t now_us);
  void look_for_flight(const Sensors& sensors, uint32_t now_us);
  bool watch_sensors(const Sensors& sensors, Outlet& outlet, uint32_t turn_us);
  void finish(frames::InputEnd why, Outlet& outlet, uint32_t now_us);
  void enable(const Sensors& sensors, Outlet& outlet, uint32_t now_us);
  void tell_card(Outlet& outlet, uint32_t now_us);
  void bound_pulses();
  uint16_t added(uint8_t servo, uint16_t base_ticks, Outlet& outlet) const;

  RowMemory* memory_ = nullptr;
  core::InputHome home_;
  core::FlyingProof flying_;
  core::InputCommand command_;
  core::StickTravel travel_;
  core::HeldSign sign_;
  uint16_t armed_min_us_ = 0;
  uint8_t rows_ = 0;
  uint8_t told_ = 0;  // frames of the card that this session has
  uint8_t beeps_ = 0;
  uint8_t senses_ = 0;  // axes that tilt and stick showed to be held the right way round
  bool hash_shown_ = false;
  bool button_spent_ = false;
};

}  // namespace app
