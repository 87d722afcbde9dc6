// The world around one instrument: time, stimuli, and what the instrument does to it.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include <vector>

#include "boards/sitl/card.h"
#include "boards/sitl/pressure_sensor.h"
#include "hal/analog_input.h"
#include "hal/imu_bus.h"
#include "hal/pulse_capture.h"
#include "hal/serial.h"
#include "hal/servo_output.h"

namespace sitl {

// Simulated time: 0.5 us steps since the world began.
using Tick = int64_t;
constexpr Tick kTicksPerUs = 2;
constexpr Tick kTicksPerMs = 2000;
constexpr Tick kNever = INT64_MAX;

struct EdgeStimulus {
  Tick at;
  uint8_t levels;
};

// The Mega's interrupt holds SCL this long behind each byte, as measured on the simulated chip.
constexpr Tick kSlaveHold = 7;

struct PacketStimulus {
  Tick start;
  Tick end;
  hal::ImuPacket packet;
};

struct ByteStimulus {
  Tick at;
  uint8_t byte;
};

struct LevelStimulus {
  Tick at;
  bool level;
};

// A sequence of events in order of time and the place reached in it.
template <typename Event>
struct Script {
  std::vector<Event> events;
  size_t next = 0;
};

// Channels on one uniform grid of time, linear between its points, constant beyond its ends.
struct Grid {
  Tick start = 0;
  Tick step = 1;
  size_t channels = 0;
  std::vector<double> values;  // one row per point

  double at(Tick when, size_t channel) const;
};

struct Pulse {
  Tick start;
  uint8_t output;
  uint16_t width_ticks;
};

struct ServoTimer {
  uint16_t width_ticks = 0;  // latched when a period begins
  Tick next_period = kNever;
};

// The charge pump behind the heartbeat: ten toggles fill it, 30 ms of silence empty it.
struct RelayModel {
  uint8_t charge = 0;
  Tick last_toggle = -kNever / 2;
  bool engaged = false;
  bool welded = false;
  bool cut = false;
};

struct PortModel {
  std::vector<uint8_t> received;  // waiting to be taken
  size_t taken = 0;
  std::vector<uint8_t> sent;
  uint32_t baud = 0;
  Tick drained_at = 0;  // when all that was queued will have left
  uint16_t lost = 0;
};

// What a reset keeps: the contents of chip and card live on, the program starts anew.
struct World {
  Tick now = 0;
  Tick booted_at = 0;
  uint32_t clock_offset_us = 0;
  uint8_t reset_source = 1;
  bool flight_mark = false;

  Script<EdgeStimulus> edges;
  Script<PacketStimulus> packets;
  Script<ByteStimulus> gps;
  Script<ByteStimulus> usb;
  Script<LevelStimulus> button;
  Grid analog;
  Grid pressure;
  uint16_t avcc_mv = 5000;

  std::vector<hal::Edge> captured;
  size_t captured_taken = 0;
  uint8_t levels = 0;
  uint16_t lost_edges = 0;
  hal::ImuPacket held[2] = {};
  uint8_t held_count = 0;
  uint16_t lost_packets = 0;
  bool awake = false;  // a packet ended: the main loop does not go to sleep
  bool button_down = false;

  Tick scan_end = kNever;
  bool scan_running = false;
  bool scan_armed = false;
  bool scan_waits = false;  // started by a packet that was not released yet
  uint8_t scan_mask = 0;
  uint8_t writing = 0;  // of `sums`, by the last scan started
  uint8_t reading = 0;
  uint16_t sums[2][hal::kAnalogSlots] = {};

  PortModel ports[3];
  std::vector<uint8_t> eeprom;
  Tick eeprom_ready_at = 0;
  bool led = false;
  bool buzzer = false;
  bool watchdog_on = false;
  Tick watchdog_fed = 0;

  ServoTimer servos[hal::kServoOutputs];
  std::vector<Pulse> pulses;
  RelayModel relay;
  std::vector<LevelStimulus> relay_log;
  std::vector<LevelStimulus> led_log;
  std::vector<LevelStimulus> buzzer_log;

  PressureSensor sensor;
  Card card;

  World();
  void cut_relay(bool cut);

  // Lets time pass, with every interrupt on its way.
  void advance_to(Tick when);
  // Time of the next interrupt at or after now.
  Tick next_event() const;
  // At `now`, or at the next whole microsecond of the clock: its instant.
  Tick start_scan();
  void set_pulse(uint8_t output, uint16_t width_ticks);
  void toggle_heartbeat();
  // Chip peripherals as a reset leaves them; stimuli and time go on.
  void reset_chip();
  // Drops stimuli of the time without power.
  void skip_stimuli();

 private:
  void fire(Tick when);
  void step_servos(Tick when);
  void step_relay(Tick when);
  void release_relay(Tick when);
};

// The one world of this library; boards/sitl/hal_*.cpp act on it.
World& world();

}  // namespace sitl
