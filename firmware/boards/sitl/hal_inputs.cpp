// hal: clock and everything that is measured.
#include "boards/sitl/world.h"
#include "hal/baro_bus.h"
#include "hal/clock.h"

namespace hal {

using sitl::world;

namespace {

int64_t clock_ticks() {
  const sitl::World& w = world();
  return w.now - w.booted_at + static_cast<int64_t>(w.clock_offset_us) * sitl::kTicksPerUs;
}

}  // namespace

uint32_t now_us() {
  return static_cast<uint32_t>(clock_ticks() / sitl::kTicksPerUs);
}

uint32_t now_ticks() {
  return static_cast<uint32_t>(clock_ticks());
}

void start_pulse_capture() {}

bool edge_waits() {
  return world().captured_taken != world().captured.size();
}

bool take_edge(Edge* edge) {
  sitl::World& w = world();
  if (w.captured_taken == w.captured.size()) {
    w.captured.clear();
    w.captured_taken = 0;
    return false;
  }
  *edge = w.captured[w.captured_taken++];
  return true;
}

uint16_t lost_edges() {
  return world().lost_edges;
}

uint8_t edge_storm() {
  return 0;
}

void start_imu_bus() {}

bool imu_packet_waits() {
  return world().held_count > 0;
}

const ImuPacket* imu_packet() {
  return world().held_count > 0 ? &world().held[0] : nullptr;
}

void release_imu_packet() {
  sitl::World& w = world();
  if (w.held_count == 0) return;
  if (w.held[0].scan_after_us != 0) {
    w.reading ^= 1U;
    w.scan_waits = false;
  }
  w.held[0] = w.held[1];
  --w.held_count;
}

uint16_t lost_imu_packets() {
  return world().lost_packets;
}

void restart_imu_bus() {}

void start_baro_bus() {
  world().sensor.reset_bus();
}

void baro_bus_write(uint8_t address, uint8_t reg, uint8_t value) {
  world().sensor.begin_write(address, reg, value);
}

void baro_bus_read(uint8_t address, uint8_t reg, uint8_t count) {
  world().sensor.begin_read(address, reg, count);
}

BusStatus step_baro_bus() {
  return world().sensor.step(world().now, world().pressure);
}

const uint8_t* baro_bus_bytes() {
  return world().sensor.bytes();
}

void start_analog() {}

void arm_scan(uint8_t mask) {
  world().scan_mask = mask;
  world().scan_armed = !world().scan_waits;
}

bool start_scan(uint32_t* started_us) {
  sitl::World& w = world();
  w.scan_armed = false;
  if (w.scan_waits) return false;
  const sitl::Tick begin = w.start_scan();
  w.reading ^= 1U;
  w.advance_to(begin);
  *started_us = now_us();
  return true;
}

bool scan_done() {
  return !world().scan_running || world().writing != world().reading;
}

uint16_t scan_sum(uint8_t slot) {
  return world().sums[world().reading][slot];
}

void measure_supply() {}

uint16_t avcc_mv() {
  return world().avcc_mv;
}

}  // namespace hal
