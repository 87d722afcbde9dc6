// The IMU's whole program between a modelled world and the Mega's own receiver.
#include <string.h>

#include "check.h"
#include "core/bytes.h"
#include "core/imu/record.h"
#include "core/ubx.h"
#include "generated/frames.h"
#include "imu/unit.h"
#include "world.h"

namespace {

// One IMU switched on in a new world; what a case changes of the world comes first.
struct Switched {
  imu::Unit unit;

  Switched() { unit.boot(); }
  void run_ms(uint16_t ms) {
    const uint32_t until_us = world.now_us + uint32_t{ms} * 1000;
    while (static_cast<int32_t>(until_us - world.now_us) > 0) {
      unit.step();
    }
  }
  void type(const char* line) {
    world.forget_printed();
    give(reinterpret_cast<const uint8_t*>(line), static_cast<uint8_t>(strlen(line)));
  }
  void give(const uint8_t* bytes, uint8_t size) {
    world.given = bytes;
    world.given_size = size;
    run_ms(20);
  }
  // A receiver's message with a 3D fix, and the next one's, which ends its epoch.
  void fix(uint32_t itow_ms, int32_t speed_mmps) {
    uint8_t payload[92] = {};
    core::put_le(payload, itow_ms);
    payload[11] = 0b0111;
    payload[20] = 3;
    payload[21] = 1;
    payload[23] = 12;
    core::put_le(payload + 60, speed_mmps);
    uint8_t message[100];
    give(message, core::put_ubx(message, 0x01, 0x07, payload, sizeof(payload)));
  }
};

constexpr uint16_t kSetUpMs = 400;
constexpr uint16_t kRestMs = 3500;  // set-up, then two still seconds and a bit

void keep(const core::ImuSettings& settings) {
  core::write_imu_record(world.eeprom, settings);
}

core::ImuSettings defaults() {
  core::ImuSettings out;
  core::default_imu_settings(out);
  return out;
}

// A period begins and ends somewhere.
bool around(int32_t count, int32_t wanted) {
  return count >= wanted - 1 && count <= wanted + 1;
}

}  // namespace

TEST_CASE("every sample leaves as one packet, its START 3.0 ms behind its data-ready") {
  world = World();
  Switched imu;
  imu.run_ms(kSetUpMs);
  REQUIRE(world.samples != 0);
  const uint16_t bursts = world.bursts;
  const uint16_t samples = world.samples;
  world.least_behind_us = UINT32_MAX;
  world.most_behind_us = 0;
  imu.run_ms(1000);
  CHECK_EQ(world.least_behind_us, 3000U);
  CHECK_EQ(world.most_behind_us, 3000U);
  CHECK(around(world.bursts - bursts, 200));
  CHECK(around(world.samples - samples, 200));
  CHECK_EQ(world.late, 0);
  CHECK_EQ(world.mega.lost(), 0);
  CHECK_EQ(world.mega.bad(), 0);
  CHECK_EQ(world.mega.sample().age_4us, 750);
  CHECK_EQ(world.mega.sample().az, -8192);
  CHECK(world.led);
}

TEST_CASE("work that takes longer than 3 ms delays its packet, and the age says so") {
  world = World();
  world.work_us = 3600;
  Switched imu;
  imu.run_ms(kSetUpMs);
  CHECK_EQ(world.behind_us, 3860U);
  CHECK_EQ(world.late, 0);
  CHECK_EQ(world.mega.sample().age_4us, 965);
  CHECK_EQ(world.mega.lost(), 0);
}

TEST_CASE("edges that came while one sample was served are numbers without a packet") {
  world = World();
  Switched imu;
  imu.run_ms(kSetUpMs);
  const uint16_t lost = world.mega.lost();
  world.pass(20000);  // something held the main loop up: four edges, the last one is read
  imu.run_ms(10);
  CHECK_EQ(world.mega.lost() - lost, 3);
}

TEST_CASE("a bus still busy at the seal costs that sample and no other") {
  world = World();
  Switched imu;
  imu.run_ms(kSetUpMs);
  const uint16_t lost = world.mega.lost();
  const uint16_t samples = world.samples;
  world.took_us = 6000;
  imu.run_ms(1000);
  CHECK_EQ(world.refused, 0);
  CHECK(around(world.samples - samples, 100));
  CHECK(world.mega.lost() - lost >= 98);
  CHECK_EQ(world.mega.bad(), 0);
}

TEST_CASE("compat: a pair of original packets at 50 Hz, the second behind the first") {
  world = World();
  core::ImuSettings settings = defaults();
  settings.compat = 1;
  settings.dlpf = 3;
  keep(settings);
  world.compass = true;
  Switched imu;
  imu.run_ms(kSetUpMs);
  CHECK_EQ(world.registers[0x1A], 3);
  const uint16_t firsts = world.firsts;
  const uint16_t seconds = world.seconds;
  const uint16_t samples = world.samples;
  imu.run_ms(1000);
  CHECK(around(world.firsts - firsts, 50));
  CHECK(around(world.seconds - seconds, 50));
  CHECK(around(world.samples - samples, 50));
  CHECK_EQ(world.starts, world.firsts + world.seconds);
  CHECK_EQ(world.refused, 0);
  CHECK(world.mega.sample().original);
  // The magnetometer never makes the main loop wait, however slow the Mega is.
  world.took_us = 4300;
  imu.run_ms(4000);
  CHECK(world.field_reads > 20);
  CHECK_EQ(world.waits, 0);
}

TEST_CASE("a chip that falls silent is set up again; its LED and packets tell") {
  world = World();
  Switched imu;
  imu.run_ms(kSetUpMs);
  CHECK(world.led);
  world.by_spi = false;
  imu.run_ms(30);
  CHECK(!world.led);
  const uint16_t samples = world.samples;
  imu.run_ms(1000);
  CHECK_EQ(world.samples, samples);
  world.by_spi = true;
  imu.run_ms(1000);
  CHECK(world.led);
  CHECK(world.samples > samples + 50);
}

TEST_CASE("a chip that is silent in flight is never looked for on the other bus") {
  world = World();
  Switched imu;
  imu.run_ms(kSetUpMs);
  world.by_spi = false;
  world.by_twi = true;
  const uint16_t samples = world.samples;
  imu.run_ms(3000);
  CHECK_EQ(world.samples, samples);
}

TEST_CASE("a chip that only answers over the bus is found there, and sends as evenly") {
  world = World();
  world.by_spi = false;
  world.by_twi = true;
  Switched imu;
  imu.run_ms(3000);
  REQUIRE(world.samples > 100);
  CHECK_EQ(world.behind_us, 3000U);
  CHECK_EQ(world.refused, 0);
}

TEST_CASE("garbage is no sample: a number is used up, nothing is sent") {
  world = World();
  Switched imu;
  imu.run_ms(kSetUpMs);
  const uint16_t starts = world.starts;
  world.registers[0x1B] = 0x18;  // another range than was set: its counts mean something else
  imu.run_ms(10);
  CHECK(world.starts <= starts + 1);
  world.registers[0x1B] = 0x08;
  imu.run_ms(1000);
  CHECK(world.starts > starts + 50);
  CHECK(world.mega.lost() >= 2);
}

TEST_CASE("the field in body axes: chip x backward, y right, z up; read behind the packet") {
  world = World();
  world.compass = true;
  world.field[0] = 100;
  world.field[1] = 200;
  world.field[2] = -300;
  Switched imu;
  imu.run_ms(3000);
  CHECK(world.field_reads > 15);
  CHECK_EQ(world.field_reads_in_work, 0);
  CHECK_EQ(world.refused, 0);
  CHECK_EQ(world.mega.lost(), 0);
  frames::MagFrame mag;
  REQUIRE(world.mega.take_mag(mag));
  CHECK_EQ(mag.mx, -100);
  CHECK((mag.my == 200 || mag.my == 201));
  CHECK_EQ(mag.mz, 300);
}

TEST_CASE("a record cut off gives no offsets and says so; a whole one is taken off") {
  for (uint8_t turn = 0; turn < 2; ++turn) {
    const bool whole = turn != 0;
    world = World();
    core::ImuSettings settings = defaults();
    settings.rate_offset[0] = 50;
    settings.offsets_valid = 1;
    keep(settings);
    world.eeprom[core::kImuRecordSize - 1] =
        whole ? world.eeprom[core::kImuRecordSize - 1] : uint8_t{0};
    Switched imu;
    imu.run_ms(kSetUpMs);
    const core::ImuSample& sample = world.mega.sample();
    CHECK_EQ(sample.p, whole ? -50 : 0);
    CHECK_EQ((sample.flags & frames::kImuFlagsOffsetsValid) != 0, whole);
    CHECK_EQ(world.writes, 0);
  }
}

TEST_CASE("switched on: watchdog, baud, which image, how often it restarted") {
  world = World();
  world.restarts = 7;
  Switched imu;
  CHECK(world.guarded);
  CHECK_EQ(world.baud, 38400U);
  CHECK(world.has_printed("imu image 0123abcd\r\n"));
  const uint16_t feeds = world.feeds;
  imu.unit.step();
  CHECK_EQ(world.feeds - feeds, 1);
  imu.run_ms(kSetUpMs);
  CHECK_EQ(world.told_restarts, 7);
}

TEST_CASE("`imu zero` at rest goes into the EEPROM, a byte when it is ready, and holds") {
  world = World();
  world.roll_rate = 33;
  {
    Switched imu;
    imu.run_ms(kRestMs);
    CHECK_EQ(world.mega.sample().p, 33);
    imu.type("imu zero\n");
    CHECK(world.has_printed("imu: kept\r\n"));
    imu.run_ms(200);
    CHECK_EQ(world.writes, core::kImuRecordSize);
    CHECK_EQ(world.writes_unready, 0);
    CHECK_EQ(world.mega.sample().p, 0);
    CHECK_EQ(world.mega.lost(), 0);
  }
  Switched again;
  again.run_ms(kSetUpMs);
  CHECK_EQ(world.mega.sample().p, 0);
  again.type("imu show\n");
  CHECK(world.has_printed("imu 33 0 0 0 0 0 "));
}

TEST_CASE("in motion nothing is changed or written; what is unknown is answered") {
  world = World();
  Switched imu;
  imu.run_ms(kRestMs);
  world.roll_rate = 3000;
  imu.run_ms(100);
  imu.type("imu zero\n");
  CHECK(world.has_printed("imu: not at rest, nothing changed\r\n"));
  imu.type("imu compat 1\n");
  CHECK(world.has_printed("imu: not at rest, nothing changed\r\n"));
  imu.type("imu fly\n");
  CHECK(world.has_printed("imu: zero level show declination iron dlpf compat\r\n"));
  CHECK_EQ(world.writes, 0);
  CHECK_EQ(world.firsts, 0);
}

TEST_CASE("another low-pass is written to the chip, which samples again within a second") {
  world = World();
  Switched imu;
  imu.run_ms(kRestMs);
  CHECK_EQ(world.registers[0x1A], 2);
  imu.type("imu dlpf 3\n");
  CHECK(world.has_printed("imu: kept\r\n"));
  const uint16_t samples = world.samples;
  imu.run_ms(1000);
  CHECK_EQ(world.registers[0x1A], 3);
  CHECK(world.samples > samples + 50);
  CHECK_EQ(world.mega.dlpf(), 3);
  // Anything else leaves the chip alone.
  const uint16_t before = world.bursts;
  imu.run_ms(2500);
  imu.type("imu declination 413\n");
  imu.run_ms(480);
  CHECK(world.has_printed("imu: kept\r\n"));
  CHECK(around(world.bursts - before, 600));
}

TEST_CASE("without a GPS receiver other bauds are tried; one that says we move forbids zeroing") {
  world = World();
  Switched imu;
  imu.run_ms(kRestMs);
  CHECK(world.bauds > 2);
  // The console sees the receiver's bytes too: a line begins behind the first end of one.
  imu.fix(385200400U, 12000);
  imu.fix(385200600U, 12000);
  imu.type("\nimu zero\n");
  CHECK(world.has_printed("imu: not at rest, nothing changed\r\n"));
  imu.fix(385200800U, 100);
  imu.fix(385201000U, 100);
  imu.type("\nimu zero\n");
  CHECK(world.has_printed("imu: kept\r\n"));
}
