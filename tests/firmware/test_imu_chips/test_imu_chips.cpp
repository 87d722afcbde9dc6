// MPU-6000 and both magnetometers on scripted buses: datasheet vectors, and chips that fail.
#include "check.h"
#include "drivers/hmc5883l.h"
#include "drivers/mpu6000.h"

namespace {

using drivers::MagChip;
using drivers::MagSample;
using drivers::MpuStatus;

// Registers of one chip; what was written can be read back.
struct MpuBus {
  static bool spi() { return true; }
  uint8_t registers[128] = {};
  bool silent = false;
  uint8_t deaf_register = 0xFF;  // writes to it are lost
  uint8_t writes = 0;
  uint8_t bursts = 0;

  MpuBus() {
    registers[0x75] = 0x68;
    registers[0x0C] = 0x58;
  }
  bool read(uint8_t reg, uint8_t* out, uint8_t size) {
    if (silent) {
      return false;
    }
    bursts = static_cast<uint8_t>(bursts + (size == 14 ? 1 : 0));
    memcpy(out, registers + reg, size);
    return true;
  }
  bool write(uint8_t reg, uint8_t value) {
    ++writes;
    if (silent) {
      return false;
    }
    if (reg != deaf_register) {
      registers[reg] = value;
    }
    return true;
  }
  void put(const int16_t (&words)[7]) {
    for (uint8_t i = 0; i < 7; ++i) {
      registers[0x3B + 2 * i] = static_cast<uint8_t>(static_cast<uint16_t>(words[i]) >> 8);
      registers[0x3C + 2 * i] = static_cast<uint8_t>(words[i]);
    }
  }
};

using Mpu = drivers::Mpu6000<MpuBus>;

bool start(Mpu& mpu, uint32_t& now_us) {
  for (uint16_t turn = 0; turn < 400; ++turn) {
    now_us += 1000;
    if (mpu.poll(now_us)) {
      return true;
    }
  }
  return false;
}

// Two magnetometers' registers, each at its address.
struct MagBus {
  uint8_t address = 0x1E;
  uint8_t registers[16] = {};
  bool silent = false;
  uint8_t transfers = 0;

  bool read(uint8_t to, uint8_t reg, uint8_t* out, uint8_t size) {
    ++transfers;
    if (silent || to != address) {
      return false;
    }
    memcpy(out, registers + reg, size);
    return true;
  }
  bool write(uint8_t to, uint8_t reg, uint8_t value) {
    ++transfers;
    if (silent || to != address) {
      return false;
    }
    registers[reg] = value;
    return true;
  }
  void be_hmc() {
    address = 0x1E;
    registers[10] = 'H';
    registers[11] = '4';
    registers[12] = '3';
  }
  void be_qmc() {
    address = 0x0D;
    registers[0x0D] = 0xFF;
  }
};

struct Compass {
  MagBus bus;
  drivers::Magnetometer<MagBus> chip{bus};
  MagSample sample = {};
  uint32_t now_us = 0xFFF00000U;

  uint16_t run_ms(uint16_t ms) {
    uint16_t samples = 0;
    for (uint16_t i = 0; i < ms; ++i) {
      now_us += 1000;
      samples = static_cast<uint16_t>(samples + (chip.poll(now_us, sample) ? 1 : 0));
    }
    return samples;
  }
};

}  // namespace

TEST_CASE("the set-up waits for the chip's own times and writes the ranges") {
  MpuBus bus;
  Mpu mpu(bus, 2);
  uint32_t now_us = 0xFFFFFF00U;
  const uint32_t from_us = now_us;
  REQUIRE(start(mpu, now_us));
  CHECK(now_us - from_us >= 135000U);
  CHECK_EQ(bus.registers[0x19], 4);
  CHECK_EQ(bus.registers[0x1A], 2);
  CHECK_EQ(bus.registers[0x1B], 0x08);
  CHECK_EQ(bus.registers[0x1C], 0x08);
  CHECK_EQ(bus.registers[0x6A], 0x10);
  CHECK_EQ(bus.registers[0x38], 1);
  CHECK_EQ(mpu.product_id(), 0x58);
}

TEST_CASE("one burst, datasheet vectors, axes of the board turned to the body's") {
  MpuBus bus;
  Mpu mpu(bus, 3);
  core::ImuRawSample sample = {};
  CHECK(mpu.read(sample) == MpuStatus::kNotReady);
  uint32_t now_us = 0;
  REQUIRE(start(mpu, now_us));
  // 8192 is 1 g, 6550 is 100 deg/s, -16384 is -250.1 deg/s, -521 is 35.0 degC.
  bus.put({100, -200, 8192, -521, 6550, -16384, 300});
  REQUIRE(mpu.read(sample) == MpuStatus::kSample);
  CHECK_EQ(bus.bursts, 1);
  CHECK_EQ(sample.rates[0], 6550);
  CHECK_EQ(sample.rates[1], 16384);
  CHECK_EQ(sample.rates[2], -300);
  CHECK_EQ(sample.force[0], 100);
  CHECK_EQ(sample.force[1], 200);
  CHECK_EQ(sample.force[2], -8192);
  CHECK_EQ(sample.temperature_cdegc, 3500);
  CHECK(!sample.gyro_saturated);
  CHECK(!sample.accel_saturated);
}

TEST_CASE("saturation is told for the sensor it befalls, and INT16_MIN never comes out") {
  MpuBus bus;
  Mpu mpu(bus, 2);
  uint32_t now_us = 0;
  REQUIRE(start(mpu, now_us));
  core::ImuRawSample sample = {};
  bus.put({1, 2, 3, 4, INT16_MIN, 6, 7});
  REQUIRE(mpu.read(sample) == MpuStatus::kSample);
  CHECK(sample.gyro_saturated);
  CHECK(!sample.accel_saturated);
  CHECK_EQ(sample.rates[0], -32767);
  bus.put({1, INT16_MIN, 3, 4, 5, 6, 7});
  REQUIRE(mpu.read(sample) == MpuStatus::kSample);
  CHECK(!sample.gyro_saturated);
  CHECK(sample.accel_saturated);
  CHECK_EQ(sample.force[1], 32767);
}

TEST_CASE("revision C's accelerations are brought to 8192 LSB per g") {
  const uint8_t ids[] = {0x14, 0x15, 0x54, 0x55};
  for (const uint8_t id : ids) {
    CHECK(Mpu::is_revision_c(id));
  }
  const uint8_t others[] = {0x00, 0x16, 0x18, 0x56, 0x58, 0x59, 0x68};
  for (const uint8_t id : others) {
    CHECK(!Mpu::is_revision_c(id));
  }
  MpuBus bus;
  bus.registers[0x0C] = 0x55;
  Mpu mpu(bus, 2);
  uint32_t now_us = 0;
  REQUIRE(start(mpu, now_us));
  core::ImuRawSample sample = {};
  bus.put({-4096, 0, 4096, 0, 0, 0, 1});
  REQUIRE(mpu.read(sample) == MpuStatus::kSample);
  CHECK_EQ(sample.force[0], -8192);
  CHECK_EQ(sample.force[2], -8192);
  CHECK(!sample.accel_saturated);
  bus.put({-20000, 0, 0, 0, 0, 0, 1});
  REQUIRE(mpu.read(sample) == MpuStatus::kSample);
  CHECK_EQ(sample.force[0], -32767);
  CHECK(sample.accel_saturated);
}

TEST_CASE("a silent chip, a wrong one, one that forgets its range: tried again every half second") {
  for (uint8_t fault = 0; fault < 3; ++fault) {
    MpuBus bus;
    bus.silent = fault == 0;
    bus.registers[0x75] = fault == 1 ? 0x12 : 0x68;
    bus.deaf_register = fault == 2 ? 0x1B : 0xFF;
    Mpu mpu(bus, 2);
    uint32_t now_us = 0;
    CHECK(!start(mpu, now_us));
    CHECK(!mpu.running());
    CHECK(bus.writes <= 20);
    bus.silent = false;
    bus.registers[0x75] = 0x68;
    bus.deaf_register = 0xFF;
    CHECK((start(mpu, now_us) || start(mpu, now_us)));
  }
}

TEST_CASE("silence, garbage and a stuck converter are not samples") {
  MpuBus bus;
  Mpu mpu(bus, 2);
  uint32_t now_us = 0;
  REQUIRE(start(mpu, now_us));
  core::ImuRawSample sample = {};
  sample.rates[0] = 77;
  CHECK(mpu.read(sample) == MpuStatus::kGarbage);  // zeros throughout
  bus.put({-1, -1, -1, -1, -1, -1, -1});
  CHECK(mpu.read(sample) == MpuStatus::kGarbage);
  bus.silent = true;
  CHECK(mpu.read(sample) == MpuStatus::kBusError);
  CHECK_EQ(sample.rates[0], 77);
  bus.silent = false;
  bus.put({1, 2, 8192, 4, 5, 6, 7});
  uint8_t samples = 0;
  for (uint8_t i = 0; i < 100; ++i) {
    samples = static_cast<uint8_t>(samples + (mpu.read(sample) == MpuStatus::kSample ? 1 : 0));
  }
  CHECK_EQ(samples, 20);
  CHECK(mpu.read(sample) == MpuStatus::kStuck);
  mpu.restart(now_us);
  CHECK((start(mpu, now_us) || start(mpu, now_us)));
  CHECK(mpu.read(sample) == MpuStatus::kStuck);  // set up again, and still the same bytes
  bus.put({1, 2, 8193, 4, 5, 6, 7});
  CHECK(mpu.read(sample) == MpuStatus::kSample);
  mpu.restart(now_us);
  CHECK(mpu.read(sample) == MpuStatus::kNotReady);
  CHECK((start(mpu, now_us) || start(mpu, now_us)));
}

TEST_CASE("a chip that lost its ranges, or a line that garbles them, gives no samples") {
  constexpr uint8_t kLost[] = {0x1A, 0x1B, 0x1C};
  for (const uint8_t lost : kLost) {
    MpuBus bus;
    Mpu mpu(bus, 2);
    uint32_t now_us = 0;
    REQUIRE(start(mpu, now_us));
    bus.put({1, 2, 8192, 4, 5, 6, 7});
    core::ImuRawSample sample = {};
    CHECK(mpu.read(sample) == MpuStatus::kSample);
    bus.registers[lost] = 0;
    bus.put({1, 2, 8192, 4, 500, 6, 7});
    CHECK(mpu.read(sample) == MpuStatus::kGarbage);
    CHECK_EQ(sample.rates[0], 5);
    mpu.restart(now_us);
    CHECK((start(mpu, now_us) || start(mpu, now_us)));
    CHECK(mpu.read(sample) == MpuStatus::kSample);
  }
}

TEST_CASE("HMC5883L: settings, order X Z Y, overflow, first sample after the gain dropped") {
  Compass compass;
  compass.bus.be_hmc();
  compass.bus.registers[4] = 100;   // X 100
  compass.bus.registers[5] = 0xFF;  // Z -56
  compass.bus.registers[6] = 0xC8;
  compass.bus.registers[7] = 0x02;  // Y 0x0234
  compass.bus.registers[8] = 0x34;
  CHECK_EQ(compass.run_ms(120), 0);
  CHECK(compass.chip.chip() == MagChip::kHmc5883l);
  CHECK_EQ(compass.run_ms(70), 1);
  CHECK_EQ(compass.bus.registers[0], 0x70);
  CHECK_EQ(compass.bus.registers[1], 0x20);
  CHECK_EQ(compass.bus.registers[2], 0x00);
  CHECK_EQ(compass.sample.field[0], 100);
  CHECK_EQ(compass.sample.field[1], 0x234);
  CHECK_EQ(compass.sample.field[2], -56);
  compass.bus.registers[3] = 0xF0;  // -4096 + 100: beyond 12 bits
  CHECK_EQ(compass.run_ms(500), 0);
}

TEST_CASE(
    "QMC5883L under the other's name: recognised, order X Y Z, scaled to 1090 LSB per gauss") {
  Compass compass;
  compass.bus.be_qmc();
  compass.bus.registers[0] = 0xE0;  // 12000: one gauss
  compass.bus.registers[1] = 0x2E;
  compass.bus.registers[3] = 0x80;  // overflow on y first
  compass.run_ms(300);
  CHECK(compass.chip.chip() == MagChip::kQmc5883l);
  CHECK_EQ(compass.sample.field[0], 0);
  compass.bus.registers[3] = 0xD1;  // -12000 on y
  compass.bus.registers[2] = 0x20;
  CHECK(compass.run_ms(300) > 0);
  CHECK_EQ(compass.sample.field[0], 1090);
  CHECK_EQ(compass.sample.field[1], -1090);
  CHECK_EQ(compass.bus.registers[9], 0x05);
}

TEST_CASE("a magnetometer absent, lost or stuck costs few transfers and comes back") {
  Compass compass;
  compass.bus.be_hmc();
  compass.bus.silent = true;
  CHECK_EQ(compass.run_ms(5000), 0);
  CHECK(compass.bus.transfers <= 12);
  compass.bus.silent = false;
  uint16_t samples = 0;
  for (uint16_t i = 0; i < 3000; ++i) {
    compass.bus.registers[4] = static_cast<uint8_t>(i);
    samples = static_cast<uint16_t>(samples + compass.run_ms(1));
  }
  CHECK(samples > 10);
  compass.bus.silent = true;
  compass.run_ms(300);
  CHECK(compass.chip.chip() == MagChip::kNone);
  compass.bus.silent = false;
  CHECK(compass.run_ms(3000) > 5);
  CHECK_EQ(compass.run_ms(2000), 0);  // the same three numbers for 2 s
}
