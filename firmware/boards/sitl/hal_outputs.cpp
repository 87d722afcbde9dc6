// hal: everything that acts, is stored or is sent.
#include <algorithm>

#include "boards/sitl/world.h"
#include "core/crc.h"
#include "hal/block_device.h"
#include "hal/eeprom.h"
#include "hal/panel.h"
#include "hal/relay.h"
#include "hal/system.h"

namespace hal {

using sitl::kTicksPerMs;
using sitl::kTicksPerUs;
using sitl::Tick;
using sitl::world;

namespace {

constexpr uint16_t kSendBuffer = 128;
constexpr Tick kAskTicks = 50 * kTicksPerUs;
constexpr Tick kStartTicks = 20 * kTicksPerMs;
constexpr Tick kAccessTicks = 200 * kTicksPerUs;    // until a block asked for comes
constexpr Tick kProgramTicks = 1000 * kTicksPerUs;  // a single block
constexpr uint8_t kPortions = 4;                    // of a single block, one a call
constexpr Tick kPortionTicks = 225 * kTicksPerUs;
constexpr Tick kSpiByteTicks = 3;  // 1.5 us: 8 MHz and the loop around it
constexpr Tick kEepromTicks = 3400 * kTicksPerUs;

uint8_t block[kCardBlockBytes];
uint16_t block_filled = 0;

// A single block on its way, or a card that starts.
struct Single {
  uint32_t lba = 0;
  Tick ready = 0;
  uint8_t portions = 0;
} single;

void begin_single(uint32_t lba) {
  single = {lba, world().now + kAccessTicks, 0};
}

// Asking takes time too: a loop that asks again and again must not stand still in it.
CardStatus still_busy() {
  world().advance_to(world().now + kAskTicks);
  return CardStatus::kBusy;
}

// One portion passes over the bus. True: it was the last.
bool portion_passed() {
  world().advance_to(world().now + kPortionTicks);
  return ++single.portions == kPortions;
}

sitl::PortModel& model(Port port) {
  return world().ports[static_cast<uint8_t>(port)];
}

Tick byte_ticks(const sitl::PortModel& port) {
  return port.baud == 0 ? 0 : 10 * 1000000 * kTicksPerUs / static_cast<Tick>(port.baud);
}

void log_level(std::vector<sitl::LevelStimulus>* log, bool* level, bool on) {
  if (*level == on) return;
  *level = on;
  log->push_back({world().now, on});
}

}  // namespace

void set_servo_pulse(uint8_t output, uint16_t width_ticks) {
  if (output < kServoOutputs) world().set_pulse(output, width_ticks);
}

void toggle_heartbeat() {
  world().toggle_heartbeat();
}

bool relay_engaged() {
  return world().relay.engaged || world().relay.welded;
}

void start_card() {
  single.ready = world().now + kStartTicks;
}

CardStatus poll_start() {
  return world().now < single.ready ? still_busy() : world().card.start(world().now);
}

CardStatus read_card_id(uint8_t* id) {
  if (!world().card.present()) return CardStatus::kAbsent;
  std::copy_n(world().card.id(), kCardIdBytes, id);
  return CardStatus::kOk;
}

uint32_t card_blocks() {
  return world().card.blocks();
}

void begin_read(uint32_t lba) {
  begin_single(lba);
}

CardStatus poll_read(uint8_t* to) {
  world().card.step(world().now);
  if (!world().card.usable()) return CardStatus::kAbsent;
  if (world().now < single.ready || world().card.programming()) return still_busy();
  return portion_passed() ? world().card.read(single.lba, to) : CardStatus::kBusy;
}

void begin_write(uint32_t lba) {
  begin_single(lba);
}

CardStatus poll_write(const uint8_t* from) {
  world().card.step(world().now);
  if (!world().card.usable()) return CardStatus::kAbsent;
  if (world().now < single.ready || world().card.programming()) return still_busy();
  if (single.portions == kPortions) return CardStatus::kOk;
  if (!portion_passed()) return CardStatus::kBusy;
  const CardStatus status = world().card.write(single.lba, from, world().now, kProgramTicks);
  return status == CardStatus::kOk ? CardStatus::kBusy : status;
}

CardStatus begin_stream(uint32_t lba) {
  return world().card.begin_stream(lba, world().now);
}

CardStatus poll_stream() {
  return world().card.poll_stream(world().now);
}

void open_block() {
  block_filled = 0;
}

uint32_t put_block(const uint8_t* bytes, uint16_t size, uint32_t crc32) {
  world().advance_to(world().now + size * kSpiByteTicks);
  for (uint16_t i = 0; i < size && block_filled < kCardBlockBytes; ++i) {
    block[block_filled++] = bytes[i];
  }
  core::Crc32 crc;
  crc.set_state(crc32);
  crc.add(bytes, size);
  return crc.state();
}

CardStatus close_block() {
  if (block_filled != kCardBlockBytes) return CardStatus::kError;
  return world().card.write_stream(block, world().now);
}

void end_stream() {
  world().card.end_stream();
}

void open_port(Port port, uint32_t baud) {
  model(port).baud = baud;
  model(port).drained_at = world().now;
}

bool take_byte(Port port, uint8_t* byte) {
  sitl::PortModel& from = model(port);
  if (from.taken == from.received.size()) return false;
  *byte = from.received[from.taken++];
  return true;
}

uint16_t send_room(Port port) {
  const sitl::PortModel& to = model(port);
  const Tick per_byte = byte_ticks(to);
  if (per_byte == 0) return 0;
  const Tick queued = std::max<Tick>(0, to.drained_at - world().now + per_byte - 1) / per_byte;
  return static_cast<uint16_t>(std::max<Tick>(0, kSendBuffer - queued));
}

void send_byte(Port port, uint8_t byte) {
  sitl::PortModel& to = model(port);
  to.sent.push_back(byte);
  to.drained_at = std::max(to.drained_at, world().now) + byte_ticks(to);
}

void send_bytes(Port port, const uint8_t* bytes, uint8_t size) {
  while (size-- != 0) send_byte(port, *bytes++);
}

uint16_t lost_bytes(Port port) {
  return model(port).lost;
}

uint8_t read_eeprom(uint16_t address) {
  return world().eeprom[address % kEepromBytes];
}

void read_eeprom_bytes(uint16_t address, void* to, uint8_t size) {
  uint8_t* bytes = static_cast<uint8_t*>(to);
  while (size-- != 0) *bytes++ = read_eeprom(address++);
}

bool eeprom_ready() {
  return world().now >= world().eeprom_ready_at;
}

void write_eeprom(uint16_t address, uint8_t value) {
  uint8_t& place = world().eeprom[address % kEepromBytes];
  if (place == value) return;
  place = value;
  world().eeprom_ready_at = world().now + kEepromTicks;
}

void set_led(bool on) {
  log_level(&world().led_log, &world().led, on);
}

void set_buzzer(bool on) {
  log_level(&world().buzzer_log, &world().buzzer, on);
}

bool button_pressed() {
  return world().button_down;
}

ResetSource reset_source() {
  return static_cast<ResetSource>(world().reset_source);
}

uint32_t crash_address() {
  return 0;
}

void set_flight_mark(bool flying) {
  world().flight_mark = flying;
}

bool flight_mark() {
  return world().flight_mark;
}

void start_watchdog() {
  world().watchdog_on = true;
  world().watchdog_fed = world().now;
}

void feed_watchdog() {
  world().watchdog_fed = world().now;
}

void sleep_until_interrupt() {
  sitl::World& w = world();
  if (!w.awake) {
    const Tick next_ms = (w.now / kTicksPerMs + 1) * kTicksPerMs;
    w.advance_to(std::max(w.now + 1, std::min(next_ms, w.next_event())));
  }
  w.awake = false;
}

// Here interrupts take no time.
uint16_t idle_until_interrupt() {
  const Tick from = sitl::world().now;
  sleep_until_interrupt();
  return static_cast<uint16_t>((sitl::world().now - from) / sitl::kTicksPerUs);
}

uint16_t stack_free_bytes() {
  return 65535U;
}

const char* board_name() {
  return "sitl";
}

uint32_t image_hash() {
  return 0;  // a library of this computer is no image
}

}  // namespace hal
