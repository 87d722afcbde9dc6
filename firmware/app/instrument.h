// The whole instrument. A board owns one, calls boot() once and step() for ever.
#pragma once

#include <stdint.h>

#include "app/ascii_row.h"
#include "app/card_console.h"
#include "app/outlet.h"
#include "app/panel.h"
#include "app/pilot_link.h"
#include "app/recorder.h"
#include "app/sensors.h"
#include "app/status.h"
#include "app/store.h"
#include "app/telemetry.h"
#include "app/test_inputs.h"
#include "core/airborne.h"
#include "core/byte_ring.h"
#include "core/supply.h"

namespace app {

class Instrument {
 public:
  // 500 ms of frames at 100 Hz filled 4350 B of it, 250 ms at 200 Hz 4221 B.
  static constexpr uint16_t kRingBytes = 4668;

  Instrument() = default;
  Instrument(const Instrument&) = delete;
  Instrument& operator=(const Instrument&) = delete;

  void boot();
  // One turn of the main loop, the sleep at its end included.
  void step();
  // Whether a row may be flown: `lend` is to give memory for it before the next turn, and to take
  // it back (null) where none may.
  bool wants_row_memory() const { return inputs_.wants_memory(); }
  void lend(RowMemory* memory) { inputs_.lend(memory, outlet_, turn_us_); }

  Recorder& recorder() { return recorder_; }
  const PilotLink& pilot() const { return pilot_; }
  const frames::ConfigFrame& config() const { return config_; }

 private:
  void step_slow(uint32_t now_us);
  bool write_status(uint32_t now_us);
  void decide_recording(uint32_t now_us);
  void listen(uint32_t now_us);
  uint32_t idle_us();
  void pass_self_test();
  void put_system(uint32_t now_us);
  void put_telemetry_heads(uint32_t now_us);

  uint8_t ring_bytes_[kRingBytes] = {};
  core::ByteRing ring_{ring_bytes_, kRingBytes};
  frames::ConfigFrame config_ = {};
  Telemetry telemetry_;
  AsciiRow ascii_row_;
  Outlet outlet_{ring_, telemetry_};
  Store store_;
  TestInputs inputs_;
  PilotLink pilot_;
  Sensors sensors_;
  Recorder recorder_{ring_, outlet_, store_, sensors_};
  Panel panel_;
  Status status_;
  CardConsole card_console_;
  core::Airborne airborne_;
  core::Every second_;
  uint32_t turn_us_ = 0;    // when this turn of the loop began
  uint32_t uptime_us_ = 0;  // part of a second
  uint32_t uptime_s_ = 0;
  uint32_t asleep_us_ = 0;   // since the last frame `system`
  uint32_t system_us_ = 0;   // when that was made
  uint16_t counted_us_ = 0;  // rests in which the chip stayed awake and counted
  uint16_t idle_us_ = 0;     // of these, left by interrupts
  uint16_t loop_max_us_ = 0;
  uint8_t counted_turn_ = 0;
  uint8_t slot_ = 0;          // of step_slow()
  bool learned_ = false;      // in the last turn that made no frame
  uint8_t put_off_ = 0;       // turns for which the frame `system` waits; 0: it is not due
  core::SupplyWatch supply_;  // the self-test
};

}  // namespace app
