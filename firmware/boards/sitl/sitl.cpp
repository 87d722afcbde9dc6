#include "boards/sitl/sitl.h"

#include <string.h>

#include <algorithm>
#include <memory>

#include "app/instrument.h"
#include "boards/sitl/world.h"
#include "core/settings.h"
#include "hal/system.h"

namespace {

using sitl::Tick;
using sitl::World;
using sitl::world;

std::unique_ptr<app::Instrument> instrument;
app::RowMemory row_memory;  // on the Mega's stack
bool row_memory_lent = false;
uint32_t file_blocks = 0;

void boot(uint8_t source) {
  instrument.reset();
  World& w = world();
  w.skip_stimuli();
  w.booted_at = w.now;
  w.reset_source = source;
  instrument.reset(new app::Instrument);
  row_memory_lent = false;
  if (file_blocks != 0) instrument->recorder().set_file_blocks(file_blocks);
  instrument->boot();
}

void fill(sitl::Grid* grid,
          size_t channels,
          int64_t start,
          int64_t step,
          const double* values,
          size_t rows) {
  grid->start = start;
  grid->step = step > 0 ? step : 1;
  grid->channels = channels;
  grid->values.assign(values, values + rows * channels);
}

void add_bytes(sitl::Script<sitl::ByteStimulus>* script,
               const int64_t* at,
               const uint8_t* bytes,
               size_t count) {
  for (size_t i = 0; i < count; ++i) script->events.push_back({at[i], bytes[i]});
}

}  // namespace

extern "C" {

void sitl_create() {
  instrument.reset();
  file_blocks = 0;
  world() = World();
}

void sitl_set_clock_offset(uint32_t offset_us) {
  world().clock_offset_us = offset_us;
}

void sitl_set_file_blocks(uint32_t blocks) {
  file_blocks = blocks;
}

void sitl_set_eeprom(const uint8_t* bytes) {
  world().eeprom.assign(bytes, bytes + world().eeprom.size());
}

void sitl_get_eeprom(uint8_t* bytes) {
  std::copy(world().eeprom.begin(), world().eeprom.end(), bytes);
}

int sitl_set_config(const uint8_t* config, size_t size) {
  frames::ConfigFrame frame;
  if (size != sizeof frame) return 0;
  memcpy(&frame, config, size);
  if (!core::settings_in_range(frame)) return 0;
  core::write_settings(world().eeprom.data() + app::Store::kSettingsAddress, frame);
  return 1;
}

size_t sitl_default_config(uint8_t* config, size_t capacity) {
  frames::ConfigFrame frame;
  core::default_settings(frame);
  memcpy(config, &frame, std::min(capacity, sizeof frame));
  return sizeof frame;
}

void sitl_insert_card(uint8_t* image, uint32_t blocks, const uint8_t* id) {
  world().card.insert(image, blocks, id);
}

void sitl_add_edges(const int64_t* at, const uint8_t* levels, size_t count) {
  for (size_t i = 0; i < count; ++i) world().edges.events.push_back({at[i], levels[i]});
}

void sitl_add_packets(const int64_t* start,
                      const uint8_t* address,
                      const uint8_t* length,
                      const uint8_t* bytes,
                      uint32_t byte_ticks,
                      size_t count) {
  for (size_t i = 0; i < count; ++i) {
    sitl::PacketStimulus stimulus = {};
    stimulus.start = start[i];
    const Tick byte = static_cast<Tick>(byte_ticks) + sitl::kSlaveHold;
    stimulus.end = start[i] + byte * (1 + length[i]);
    stimulus.packet.address = address[i];
    stimulus.packet.length = std::min<uint8_t>(length[i], hal::kImuPacketBytes);
    memcpy(stimulus.packet.bytes, bytes + i * hal::kImuPacketBytes, stimulus.packet.length);
    world().packets.events.push_back(stimulus);
  }
}

void sitl_set_analog(int64_t start, int64_t step, const double* counts, size_t rows) {
  fill(&world().analog, hal::kAnalogSlots, start, step, counts, rows);
}

void sitl_set_supply(uint16_t avcc_mv) {
  world().avcc_mv = avcc_mv;
}

void sitl_weld_relay(int welded) {
  world().relay.welded = welded != 0;
}

void sitl_cut_relay(int cut) {
  world().cut_relay(cut != 0);
}

void sitl_set_pressure(
    const uint16_t* words, int64_t start, int64_t step, const double* raw, size_t rows) {
  world().sensor.configure(sitl::PressureSensor::Chip::kBmp085, words);
  fill(&world().pressure, 2, start, step, raw, rows);
}

void sitl_set_bmp280(
    const uint16_t* words, int64_t start, int64_t step, const double* raw, size_t rows) {
  world().sensor.configure(sitl::PressureSensor::Chip::kBmp280, words);
  fill(&world().pressure, 2, start, step, raw, rows);
}

void sitl_remove_pressure() {
  world().sensor.set_present(false);
}

void sitl_hold_pressure_bus(int held) {
  world().sensor.hold_line(held != 0);
}

void sitl_add_gps(const int64_t* at, const uint8_t* bytes, size_t count) {
  add_bytes(&world().gps, at, bytes, count);
}

void sitl_add_usb(const int64_t* at, const uint8_t* bytes, size_t count) {
  add_bytes(&world().usb, at, bytes, count);
}

void sitl_hold_port(int port, int64_t until) {
  if (port >= 0 && port <= 2) world().ports[port].drained_at = until;
}

void sitl_add_button(const int64_t* at, const uint8_t* pressed, size_t count) {
  for (size_t i = 0; i < count; ++i) world().button.events.push_back({at[i], pressed[i] != 0});
}

void sitl_add_card_events(const int64_t* at,
                          const uint8_t* kind,
                          const uint32_t* value,
                          size_t count) {
  for (size_t i = 0; i < count; ++i) {
    world().card.add_event({at[i], static_cast<sitl::CardFault>(kind[i]), value[i]});
  }
}

void sitl_power_on() {
  world().flight_mark = false;
  boot(static_cast<uint8_t>(hal::ResetSource::kPowerOn));
}

void sitl_power_cut(uint32_t seed) {
  instrument.reset();
  world().card.step(world().now);
  world().card.cut(seed);
  world().reset_chip();
}

void sitl_reset(uint8_t source) {
  world().card.finish();
  boot(source);
}

void sitl_run_until(int64_t at) {
  World& w = world();
  if (instrument == nullptr) {
    w.now = std::max(w.now, at);
    return;
  }
  while (w.now < at) {
    instrument->step();
    const bool wanted = instrument->wants_row_memory();
    if (wanted != row_memory_lent) instrument->lend(wanted ? &row_memory : nullptr);
    row_memory_lent = wanted;
  }
}

void sitl_state(SitlState* state) {
  World& w = world();
  w.card.step(w.now);  // what it finished by itself
  memset(state, 0, sizeof *state);
  state->now = w.now;
  state->clock_us =
      static_cast<uint32_t>((w.now - w.booted_at) / sitl::kTicksPerUs) + w.clock_offset_us;
  state->blocks_taken = w.card.blocks_taken();
  state->ground_writes = w.card.ground_writes();
  state->conversions = w.sensor.conversions();
  state->lost_edges = w.lost_edges;
  state->lost_packets = w.lost_packets;
  state->lost_gps_bytes = w.ports[1].lost;
  state->relay = w.relay.engaged;
  state->programming = w.card.programming();
  state->led = w.led;
  state->buzzer = w.buzzer;
  if (instrument == nullptr) return;
  state->powered = 1;
  state->file_number = instrument->recorder().file_number();
  state->recorder = static_cast<uint8_t>(instrument->recorder().state());
  state->volume = static_cast<uint8_t>(instrument->recorder().volume_status());
  state->drive = static_cast<uint8_t>(instrument->pilot().drive());
}

size_t sitl_pulses(int64_t* start, uint8_t* output, uint16_t* width_ticks, size_t capacity) {
  const std::vector<sitl::Pulse>& pulses = world().pulses;
  for (size_t i = 0; i < std::min(capacity, pulses.size()); ++i) {
    start[i] = pulses[i].start;
    output[i] = pulses[i].output;
    width_ticks[i] = pulses[i].width_ticks;
  }
  return pulses.size();
}

size_t sitl_levels(int what, int64_t* at, uint8_t* level, size_t capacity) {
  const World& w = world();
  const std::vector<sitl::LevelStimulus>& log =
      what == 0 ? w.relay_log : (what == 1 ? w.led_log : w.buzzer_log);
  for (size_t i = 0; i < std::min(capacity, log.size()); ++i) {
    at[i] = log[i].at;
    level[i] = log[i].level;
  }
  return log.size();
}

size_t sitl_sent(int port, uint8_t* bytes, size_t capacity) {
  if (port < 0 || port > 2) return 0;
  const std::vector<uint8_t>& sent = world().ports[port].sent;
  std::copy_n(sent.begin(), std::min(capacity, sent.size()), bytes);
  return sent.size();
}

}  // extern "C"
