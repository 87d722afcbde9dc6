// No slice of the inputs lasts 0.3 ms: the costliest of each kind, in cycles of the simulated chip.
#include "check.h"
#include "core/input_command.h"
#include "core/input_watch.h"
#include "core/test_input.h"

#ifdef __AVR__
#include <avr/io.h>

namespace {

constexpr uint16_t kMostCycles = 4800;  // 0.3 ms

// Timer 1 counts cycles.
template <typename Work>
uint16_t cycles_of(Work work) {
  TCCR1A = 0;
  TCCR1B = _BV(CS10);
  TCNT1 = 0;
  work();
  const uint16_t cycles = TCNT1;
  return cycles;
}

core::CardRow costliest() {
  core::CardRow row = {};
  row.shape = static_cast<uint8_t>(frames::CardShape::kMultisine);
  row.axes = 7;
  row.duration_ms = 19000;
  for (uint8_t i = 0; i < 30; i = static_cast<uint8_t>(i + 3)) {
    row.components[i] = static_cast<uint8_t>(90 - i);
    row.components[i + 1] = static_cast<uint8_t>(7 * i);
    row.components[i + 2] = static_cast<uint8_t>(i % 9 / 3 << 6 | 25);
  }
  for (uint8_t axis = 0; axis < 3; ++axis) row.amplitude_us[axis] = 499;
  return row;
}

}  // namespace

TEST_CASE("a look that steers ten sines on three axes") {
  core::InputCommand command;
  core::InputMemory memory = {};
  core::RcChannels rc = {{3000, 3000, 3000, 2600, 3800}, 0x1F, 0x1F};
  core::InputFacts facts = {};
  facts.rc = &rc;
  memory.row = costliest();
  memory.rate_max_usps = 4000;
  command.enable();
  command.start(memory, facts, 0);
  CHECK(cycles_of([&] { command.steer(memory, 15500); }) < kMostCycles);
}

TEST_CASE("a look at all sensors, the aircraft far from home") {
  core::InputLimits limits = {};
  limits.alpha_input = 0;
  limits.airspeed_input = 4;
  limits.beta_input = 2;
  limits.phi_max = limits.p_max = limits.q_max = limits.r_max = 30000;
  limits.az_min = -30000;
  limits.dp_max = limits.alpha_max = limits.beta_max = 4000;
  limits.height_max_pa = 60000;
  limits.distance_max_m = 3000;
  limits.still_ms = 500;
  core::InputReadings in = {};
  in.imu = in.gps = true;
  in.valid = 0xFFFF;
  in.static_pressure = 1500000;
  in.latitude = 250190000;
  in.longitude = 1210190000;
  core::InputHome home;
  home.pressure_2pa = 50000;
  home.latitude = 250000000;
  home.cosine = core::home_cosine(home.latitude);
  home.longitude = 1210000000;
  core::InputMotion motion;
  motion.start(0);
  for (uint8_t n = 0; n < 2; ++n) {
    ++in.rates[0];
    ++in.pitot[0];
    ++in.alpha[0];
    ++in.beta[0];
    ++in.latitude;
    ++in.static_pressure;
    motion.see_imu(in, 5000);
    motion.see_scan(limits, in, 5000);
    motion.see_baro(in, 5000);
    motion.see_gps(in, 5000);
  }
  core::InputWatch watch;
  watch.found[core::InputWatch::kHold] = frames::InputEnd::kDone;  // a row that holds nothing
  frames::InputEnd why = frames::InputEnd::kBank;
  const uint16_t cycles = cycles_of([&] {
    motion.see_imu(in, 10000);
    motion.see_scan(limits, in, 10000);
    motion.see_baro(in, 10000);
    motion.see_gps(in, 10000);
    motion.age(10000);
    watch.found[core::InputWatch::kImu] = core::judge_imu(limits, in);
    watch.found[core::InputWatch::kScan] = core::judge_scan(limits, in);
    watch.found[core::InputWatch::kBaro] = core::judge_baro(limits, in, home);
    watch.found[core::InputWatch::kGps] = core::judge_gps(limits, in, home);
    watch.found[core::InputWatch::kHeard] = core::judge_heard(limits, in, motion, 10000);
    why = watch.outside();
  });
  CHECK((why == frames::InputEnd::kDone));
  CHECK(cycles < kMostCycles);
}

TEST_CASE("a row is judged at its trigger") {
  core::CardRow row = costliest();
  row.crc = core::crc16(core::kCrc16Start, &row, offsetof(core::CardRow, crc));
  core::RowLimits limits = {{500, 500, 500}, 500, false};
  frames::CardFault fault = frames::CardFault::kCrc;
  CHECK(cycles_of([&] { fault = core::judge_row(row, limits); }) < 2 * kMostCycles);
  CHECK((fault == frames::CardFault::kNone));
}
#else
TEST_CASE("what a look costs is counted on the chip") {
  CHECK(sizeof(core::InputMemory) > 0);
}
#endif
