// Every peripheral of the board behind its hal, at work at once; the tests read and poke the
// variables.
#include <avr/interrupt.h>
#include <stdint.h>
#include <string.h>

#include "boards/mega2560/board.h"
#include "hal/analog_input.h"
#include "hal/clock.h"
#include "hal/eeprom.h"
#include "hal/imu_bus.h"
#include "hal/pulse_capture.h"
#include "hal/relay.h"
#include "hal/serial.h"
#include "hal/servo_output.h"
#include "hal/system.h"

extern "C" {

// ---- set by the tests ----
volatile uint16_t servo_wanted[hal::kServoOutputs];
volatile uint8_t scan_period_ms;    // 0: no scans
volatile uint8_t chatter;           // keeps the radio's transmitter busy
volatile uint8_t hang;              // 1: main loop stops; 2: with interrupts off
volatile uint8_t watch;             // 1: start the watchdog
volatile uint8_t read_eeprom_busy;  // 1: read without asking whether it is ready
volatile uint8_t wipe_eeprom;       // value to write into byte 7

// ---- read by the tests ----
uint16_t edge_ticks[512];
uint8_t edge_levels[512];
uint8_t edge_late[512];
volatile uint16_t edges;
volatile uint16_t edges_lost;

uint16_t scan_sums[hal::kAnalogSlots];
volatile uint16_t scans;
volatile uint32_t scan_start_us;
volatile uint16_t supply_mv;

uint8_t packet_bytes[8][hal::kImuPacketBytes];
uint8_t packet_address[8];
uint8_t packet_length[8];
uint32_t packet_start_us[8];
volatile uint16_t packets;
volatile uint16_t packets_lost;

uint8_t gps_bytes[256];
volatile uint16_t gps_count;
volatile uint16_t gps_lost;

volatile uint32_t clock_us;
volatile uint8_t reset_was;
volatile uint32_t crashed_at;
volatile uint16_t stack_free;
volatile uint8_t eeprom_byte;
volatile uint32_t turns;

}  // extern "C"

namespace {

uint16_t g_servo_now[hal::kServoOutputs];
uint32_t g_next_scan_us;
bool g_scanning;

void take_edges() {
  hal::Edge edge;
  while (hal::take_edge(&edge)) {
    const uint16_t at = edges;
    if (at < 512) {
      edge_ticks[at] = edge.at_ticks;
      edge_levels[at] = edge.levels;
      edge_late[at] = edge.late ? 1 : 0;
    }
    edges = uint16_t(at + 1U);
  }
  edges_lost = hal::lost_edges();
}

void serve_servos() {
  for (uint8_t output = 0; output < hal::kServoOutputs; ++output) {
    const uint16_t wanted = servo_wanted[output];
    if (wanted != g_servo_now[output]) {
      g_servo_now[output] = wanted;
      hal::set_servo_pulse(output, wanted);
    }
  }
}

void serve_scan(const uint32_t now_us) {
  if (g_scanning && hal::scan_done()) {
    for (uint8_t slot = 0; slot < hal::kAnalogSlots; ++slot) {
      scan_sums[slot] = hal::scan_sum(slot);
    }
    supply_mv = hal::avcc_mv();
    if ((scans & 127U) == 0) {
      hal::measure_supply();
    }
    scans = uint16_t(scans + 1U);
    g_scanning = false;
  }
  if (scan_period_ms != 0 && !g_scanning && int32_t(now_us - g_next_scan_us) >= 0) {
    g_next_scan_us = now_us + uint32_t(scan_period_ms) * 1000U;
    uint32_t started_us = 0;
    g_scanning = hal::start_scan(&started_us);
    scan_start_us = started_us;
  }
}

void take_packets() {
  const hal::ImuPacket* const packet = hal::imu_packet();
  if (packet != nullptr) {
    const uint8_t at = packets & 7U;
    memcpy(packet_bytes[at], packet->bytes, hal::kImuPacketBytes);
    packet_address[at] = packet->address;
    packet_length[at] = packet->length;
    packet_start_us[at] = packet->start_us;
    packets = uint16_t(packets + 1U);
    hal::release_imu_packet();
  }
  packets_lost = hal::lost_imu_packets();
}

void serve_ports() {
  uint8_t byte;
  while (hal::take_byte(hal::Port::kGps, &byte)) {
    gps_bytes[gps_count & 255U] = byte;
    gps_count = uint16_t(gps_count + 1U);
  }
  gps_lost = hal::lost_bytes(hal::Port::kGps);
  while (chatter != 0 && hal::send_room(hal::Port::kTelemetry) > 0) {
    hal::send_byte(hal::Port::kTelemetry, uint8_t(turns));
  }
}

}  // namespace

int main() {
  reset_was = static_cast<uint8_t>(hal::reset_source());
  crashed_at = hal::crash_address();
  mega::start_clock();
  hal::start_pulse_capture();
  hal::start_analog();
  hal::start_imu_bus();
  hal::open_port(hal::Port::kGps, 38400);
  hal::open_port(hal::Port::kTelemetry, 111111);
  sei();
  for (;;) {
    const uint32_t now_us = hal::now_us();
    clock_us = now_us;
    if (watch == 1) {
      hal::start_watchdog();
      watch = 2;
    }
    if (watch == 2) {
      hal::feed_watchdog();
    }
    if (hang == 2) {
      cli();
    }
    while (hang != 0) {
    }
    take_edges();
    serve_servos();
    serve_scan(now_us);
    take_packets();
    serve_ports();
    hal::toggle_heartbeat();
    if (wipe_eeprom != 0 && hal::eeprom_ready()) {
      hal::write_eeprom(7, wipe_eeprom);
      wipe_eeprom = 0;
    }
    if (hal::eeprom_ready() || read_eeprom_busy != 0) {
      eeprom_byte = hal::read_eeprom(7);
    }
    if ((turns & 255U) == 0) {
      stack_free = hal::stack_free_bytes();
    }
    turns = turns + 1;
    hal::sleep_until_interrupt();
  }
}
