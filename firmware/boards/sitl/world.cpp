#include "boards/sitl/world.h"

#include <algorithm>

#include "core/ident_trigger.h"
#include "hal/eeprom.h"

namespace sitl {

namespace {

constexpr size_t kEdgeBuffer = 64;
constexpr size_t kReceiveBuffer = 128;
constexpr Tick kPumpTicks = 30 * kTicksPerMs;
constexpr uint8_t kPumpFull = 10;
constexpr Tick kServoTicks = hal::kServoPeriodUs * kTicksPerUs;

template <typename Event>
Tick time_of_next(const Script<Event>& script, Tick Event::*member) {
  return script.next < script.events.size() ? script.events[script.next].*member : kNever;
}

void receive(PortModel* port, uint8_t byte) {
  if (port->received.size() - port->taken >= kReceiveBuffer) {
    ++port->lost;
    return;
  }
  if (port->taken > 4096) {
    port->received.erase(port->received.begin(),
                         port->received.begin() + static_cast<std::ptrdiff_t>(port->taken));
    port->taken = 0;
  }
  port->received.push_back(byte);
}

}  // namespace

World& world() {
  static World the_world;
  return the_world;
}

World::World() : eeprom(hal::kEepromBytes, 0xFF) {}

double Grid::at(Tick when, size_t channel) const {
  if (channels == 0 || values.empty()) return 0;
  const size_t rows = values.size() / channels;
  const Tick from_start = std::max<Tick>(0, when - start);
  const size_t row = std::min(static_cast<size_t>(from_start / step), rows - 1);
  const double before = values[row * channels + channel];
  if (row + 1 >= rows) return before;
  const double part = static_cast<double>(from_start % step) / static_cast<double>(step);
  return before + part * (values[(row + 1) * channels + channel] - before);
}

Tick World::next_event() const {
  Tick next = time_of_next(edges, &EdgeStimulus::at);
  next = std::min(next, time_of_next(packets, &PacketStimulus::end));
  next = std::min(next, time_of_next(gps, &ByteStimulus::at));
  next = std::min(next, time_of_next(usb, &ByteStimulus::at));
  next = std::min(next, time_of_next(button, &LevelStimulus::at));
  if (scan_running) next = std::min(next, scan_end);
  return next;
}

void World::advance_to(Tick when) {
  for (Tick next = next_event(); next <= when; next = next_event()) {
    now = std::max(now, next);
    fire(now);
  }
  now = std::max(now, when);
  step_servos(now);
  step_relay(now);
}

void World::fire(Tick when) {
  if (scan_running && scan_end <= when) scan_running = false;
  for (; time_of_next(edges, &EdgeStimulus::at) <= when; ++edges.next) {
    const EdgeStimulus& edge = edges.events[edges.next];
    levels = edge.levels;
    if (captured.size() - captured_taken >= kEdgeBuffer) {
      ++lost_edges;
      continue;
    }
    const Tick since = edge.at - booted_at + static_cast<Tick>(clock_offset_us) * kTicksPerUs;
    captured.push_back({static_cast<uint16_t>(since), edge.levels, false});
  }
  for (; time_of_next(packets, &PacketStimulus::end) <= when; ++packets.next) {
    if (held_count == 2) {
      ++lost_packets;
      continue;
    }
    awake = true;
    const PacketStimulus& stimulus = packets.events[packets.next];
    hal::ImuPacket& place = held[held_count++];
    place = stimulus.packet;
    place.start_us =
        static_cast<uint32_t>((stimulus.start - booted_at) / kTicksPerUs) + clock_offset_us;
    place.scan_after_us = 0;
    if (scan_armed && !scan_running &&
        core::starts_scan(place.address, place.length, place.bytes, scan_mask)) {
      scan_armed = false;
      scan_waits = true;
      const Tick since_boot = start_scan() - booted_at;
      place.scan_after_us = static_cast<uint16_t>(since_boot / kTicksPerUs -
                                                  (stimulus.start - booted_at) / kTicksPerUs);
    }
  }
  for (; time_of_next(gps, &ByteStimulus::at) <= when; ++gps.next) {
    receive(&ports[static_cast<size_t>(hal::Port::kGps)], gps.events[gps.next].byte);
  }
  for (; time_of_next(usb, &ByteStimulus::at) <= when; ++usb.next) {
    receive(&ports[static_cast<size_t>(hal::Port::kUsb)], usb.events[usb.next].byte);
  }
  for (; time_of_next(button, &LevelStimulus::at) <= when; ++button.next) {
    button_down = button.events[button.next].level;
  }
}

Tick World::start_scan() {
  const Tick begin = now + (now - booted_at) % kTicksPerUs;
  const Tick conversion = hal::kConversionUs * kTicksPerUs;
  const Tick hold = 12 * kTicksPerUs;  // sample and hold: 1.5 clocks of 125 kHz
  for (uint8_t slot = 0; slot < hal::kAnalogSlots; ++slot) {
    uint16_t sum = 0;
    for (uint8_t round = 0; round < hal::kAnalogRounds; ++round) {
      const Tick when = begin + hold + (round * hal::kAnalogSlots + slot) * conversion;
      const double count = std::min(1023.0, std::max(0.0, analog.at(when, slot)));
      sum = static_cast<uint16_t>(sum + static_cast<uint16_t>(count));
    }
    sums[writing ^ 1U][slot] = sum;
  }
  writing ^= 1U;
  scan_running = true;
  scan_end = begin + hal::kScanUs * kTicksPerUs;
  return begin;
}

void World::set_pulse(uint8_t output, uint16_t width_ticks) {
  ServoTimer& servo = servos[output];
  step_servos(now);
  if (servo.next_period == kNever) servo.next_period = now;
  servo.width_ticks = width_ticks;
}

void World::step_servos(Tick when) {
  for (uint8_t output = 0; output < hal::kServoOutputs; ++output) {
    ServoTimer& servo = servos[output];
    for (; servo.next_period < when; servo.next_period += kServoTicks) {
      if (servo.width_ticks > 0) pulses.push_back({servo.next_period, output, servo.width_ticks});
    }
  }
}

void World::toggle_heartbeat() {
  step_relay(now);
  relay.last_toggle = now;
  if (relay.charge < kPumpFull) ++relay.charge;
  if (relay.charge == kPumpFull && !relay.engaged && !relay.cut) {
    relay.engaged = true;
    relay_log.push_back({now, true});
  }
}

void World::step_relay(Tick when) {
  if (relay.charge == 0 || when - relay.last_toggle < kPumpTicks) return;
  relay.charge = 0;
  release_relay(relay.last_toggle + kPumpTicks);
}

void World::release_relay(Tick when) {
  if (!relay.engaged) return;
  relay.engaged = false;
  relay_log.push_back({when, false});
}

void World::cut_relay(bool cut) {
  relay.cut = cut;
  if (cut) release_relay(now);
}

void World::reset_chip() {
  step_servos(now);
  captured.clear();
  captured_taken = 0;
  held_count = 0;
  awake = false;
  scan_running = false;
  scan_end = kNever;
  scan_armed = false;
  scan_waits = false;
  reading = writing;
  for (ServoTimer& servo : servos) servo = ServoTimer();
  for (PortModel& port : ports) {
    port.received.clear();
    port.taken = 0;
    port.drained_at = now;
  }
  eeprom_ready_at = now;
  led = false;
  buzzer = false;
  watchdog_on = false;
  lost_edges = 0;
  lost_packets = 0;
  sensor.reset_bus();
}

void World::skip_stimuli() {
  fire(now);
  reset_chip();
}

}  // namespace sitl
