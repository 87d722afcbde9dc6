// Both chips transfer by transfer: each register, value and instant of the set-up, each transfer
// that fails, each limit of what is decoded.
#include <string.h>

#include "check.h"
#include "drivers/hmc5883l.h"
#include "drivers/mpu6000.h"

namespace {

using drivers::MagChip;
using drivers::MagSample;
using drivers::MpuStatus;

struct Transfer {
  uint8_t address, reg, value;  // value: written, or the size that is read
  bool write;
};

// Registers of a chip at one address; every transfer is kept, the n-th may fail.
struct Bus {
  uint8_t registers[128] = {};
  uint8_t address = 0;
  bool is_spi = true;
  uint16_t fails = 0xFFFF;
  uint8_t deaf_register = 0xFF;
  Transfer log[40];
  uint16_t count = 0;

  bool keep(uint8_t to, uint8_t reg, uint8_t value, bool write) {
    if (count < 40) {
      log[count] = {to, reg, value, write};
    }
    return count++ != fails && to == address;
  }
  bool read(uint8_t to, uint8_t reg, uint8_t* out, uint8_t size) {
    if (!keep(to, reg, size, false)) {
      return false;
    }
    memcpy(out, registers + reg, size);
    return true;
  }
  bool write(uint8_t to, uint8_t reg, uint8_t value) {
    if (!keep(to, reg, value, true)) {
      return false;
    }
    if (reg != deaf_register) {
      registers[reg] = value;
    }
    return true;
  }
  bool read(uint8_t reg, uint8_t* out, uint8_t size) { return read(0, reg, out, size); }
  bool write(uint8_t reg, uint8_t value) { return write(0, reg, value); }
  bool spi() const { return is_spi; }

  bool did(uint8_t at, uint8_t to, uint8_t reg, uint8_t value, bool write) const {
    return at < count && log[at].address == to && log[at].reg == reg && log[at].value == value &&
           log[at].write == write;
  }
  void put(const int16_t (&words)[7]) {
    for (uint8_t i = 0; i < 7; ++i) {
      registers[0x3B + 2 * i] = static_cast<uint8_t>(static_cast<uint16_t>(words[i]) >> 8);
      registers[0x3C + 2 * i] = static_cast<uint8_t>(words[i]);
    }
  }
};

struct Motion {
  Bus bus;
  drivers::Mpu6000<Bus> chip{bus, 3};
  core::ImuRawSample sample = {};
  uint32_t now_us = 0xFFFFFFFFU - 50000U;

  explicit Motion(uint8_t product_id = 0x58) {
    bus.registers[0x75] = 0x68;
    bus.registers[0x0C] = product_id;
  }
  bool after(uint32_t us) {
    now_us += us;
    return chip.poll(now_us);
  }
  bool start() {
    after(600000);
    after(100000);
    return after(35000);
  }
  MpuStatus read(const int16_t (&words)[7]) {
    bus.put(words);
    return chip.read(sample);
  }
};

}  // namespace

TEST_CASE("MPU: the set-up register by register, each at its time") {
  for (uint8_t spi = 0; spi < 2; ++spi) {
    Motion motion;
    Bus& bus = motion.bus;
    bus.is_spi = spi != 0;
    CHECK(!motion.after(0));
    REQUIRE(bus.count == 1);
    CHECK(bus.did(0, 0, 0x6B, 0x80, true));
    CHECK(!motion.after(99999));
    CHECK_EQ(bus.count, 1);
    CHECK(!motion.after(1));
    REQUIRE(bus.count == 4);
    CHECK(bus.did(1, 0, 0x75, 1, false));
    CHECK(bus.did(2, 0, 0x0C, 1, false));
    CHECK(bus.did(3, 0, 0x6B, 0x01, true));
    CHECK(!motion.after(34999));
    CHECK_EQ(bus.count, 4);
    CHECK(!motion.chip.running());
    CHECK(motion.after(1));
    CHECK(motion.chip.running());
    uint8_t at = 4;
    if (spi != 0) {
      CHECK(bus.did(at++, 0, 0x6A, 0x10, true));
    }
    const uint8_t writes[][2] = {
        {0x19, 4}, {0x1A, 3}, {0x1B, 8}, {0x1C, 8}, {0x37, 0x10}, {0x38, 1}};
    for (const auto& one : writes) {
      CHECK(bus.did(at++, 0, one[0], one[1], true));
      CHECK(bus.did(at++, 0, one[0], 1, false));
    }
    CHECK_EQ(bus.count, at);
    CHECK(motion.after(1));
    CHECK_EQ(bus.count, at);
    CHECK_EQ(motion.chip.product_id(), 0x58);
    CHECK_EQ(motion.chip.dlpf(), 3);
  }
}

TEST_CASE("MPU: whichever transfer fails, all begins again half a second later") {
  for (uint8_t fails = 0; fails < 17; ++fails) {
    Motion motion;
    motion.bus.fails = fails;
    const uint32_t waits_us[] = {0, 100000, 35000};
    uint8_t step = 0;
    while (motion.bus.count <= fails && step < 3) {
      CHECK(!motion.after(waits_us[step++]));
    }
    CHECK_EQ(motion.bus.count, fails + 1);
    CHECK(!motion.chip.running());
    CHECK(!motion.after(499999));
    CHECK_EQ(motion.bus.count, fails + 1);
    CHECK(!motion.after(1));
    CHECK(motion.bus.did(static_cast<uint8_t>(fails + 1), 0, 0x6B, 0x80, true));
    CHECK(!motion.after(100000));
    CHECK(motion.after(35000));
  }
  const uint8_t deaf[] = {0x19, 0x1A, 0x1B, 0x1C, 0x37, 0x38};
  for (const uint8_t reg : deaf) {
    Motion motion;
    motion.bus.deaf_register = reg;
    CHECK(!motion.start());
    motion.bus.deaf_register = 0xFF;
    CHECK(motion.start());
  }
}

TEST_CASE("MPU: who it is, whatever its lowest and highest bit") {
  const struct {
    uint8_t who;
    bool known;
  } cases[] = {{0x68, true},
               {0x69, true},
               {0xE8, true},
               {0xE9, true},
               {0x6A, false},
               {0x6C, false},
               {0x60, false},
               {0x78, false},
               {0x48, false},
               {0x28, false},
               {0x00, false},
               {0xFF, false}};
  for (const auto& one : cases) {
    Motion motion;
    motion.bus.registers[0x75] = one.who;
    CHECK_EQ(motion.start(), one.known);
  }
  for (uint16_t id = 0; id < 256; ++id) {
    const bool c = (id & 0x1F) == 0x14 || (id & 0x1F) == 0x15;
    CHECK_EQ(drivers::Mpu6000<Bus>::is_revision_c(static_cast<uint8_t>(id)), c);
  }
}

TEST_CASE("MPU: every axis with its sign, each end of the scale for its own sensor") {
  Motion motion;
  REQUIRE(motion.start());
  core::ImuRawSample& sample = motion.sample;
  REQUIRE(motion.read({11, 22, 33, 0, 44, 55, 66}) == MpuStatus::kSample);
  const int16_t force[] = {11, -22, -33};
  const int16_t rates[] = {44, -55, -66};
  for (uint8_t axis = 0; axis < 3; ++axis) {
    CHECK_EQ(sample.force[axis], force[axis]);
    CHECK_EQ(sample.rates[axis], rates[axis]);
  }
  const struct {
    int16_t raw, straight, turned;
    bool at_end;
  } cases[] = {{32759, 32759, -32759, false},
               {32760, 32760, -32760, true},
               {32767, 32767, -32767, true},
               {-32759, -32759, 32759, false},
               {-32760, -32760, 32760, true},
               {INT16_MIN, -32767, 32767, true},
               {-32767, -32767, 32767, true}};
  for (const auto& one : cases) {
    for (uint8_t which = 0; which < 6; ++which) {
      int16_t words[7] = {1, 2, 3, 0, 4, 5, 6};
      words[which < 3 ? which : which + 1] = one.raw;
      REQUIRE(motion.read(words) == MpuStatus::kSample);
      CHECK_EQ(sample.accel_saturated, one.at_end && which < 3);
      CHECK_EQ(sample.gyro_saturated, one.at_end && which >= 3);
      const int16_t came = which < 3 ? sample.force[which] : sample.rates[which - 3];
      CHECK_EQ(came, which % 3 == 0 ? one.straight : one.turned);
    }
  }
  // Data sheet: raw / 340 + 36.53 degC.
  const int16_t temperatures[][2] = {{0, 3653},
                                     {340, 3753},
                                     {-340, 3553},
                                     {-12420, 1},
                                     {-521, 3500},
                                     {16, 3657},
                                     {17, 3658},
                                     {-17, 3648}};
  for (const auto& one : temperatures) {
    REQUIRE(motion.read({1, 2, 3, one[0], 4, 5, static_cast<int16_t>(one[0] + 9)}) ==
            MpuStatus::kSample);
    CHECK_EQ(sample.temperature_cdegc, one[1]);
  }
}

TEST_CASE("MPU: revision C's forces are doubled to the end of the scale") {
  Motion motion(0x14);
  REQUIRE(motion.start());
  const struct {
    int16_t raw, twice;
    bool at_end;
  } cases[] = {{100, 200, false},
               {16379, 32758, false},
               {16380, 32760, true},
               {16384, 32767, true},
               {-16383, -32766, true},
               {-16384, -32767, true},
               {-16379, -32758, false},
               {INT16_MIN, -32767, true},
               {32767, 32767, true}};
  for (const auto& one : cases) {
    REQUIRE(motion.read({one.raw, 2, 3, 4, 5, 6, one.twice}) == MpuStatus::kSample);
    CHECK_EQ(motion.sample.force[0], one.twice);
    CHECK_EQ(motion.sample.accel_saturated, one.at_end);
    CHECK_EQ(motion.sample.force[1], -4);
    CHECK_EQ(motion.sample.rates[0], 5);
  }
}

TEST_CASE("MPU: only all zeros or all ones are a line without a chip") {
  Motion motion;
  REQUIRE(motion.start());
  for (uint8_t all = 0; all < 3; ++all) {
    const uint8_t bytes[] = {0x00, 0xFF, 0x55};
    for (uint8_t odd = 0; odd <= 14; ++odd) {
      memset(motion.bus.registers + 0x3B, bytes[all], 14);
      if (odd < 14) {
        motion.bus.registers[0x3B + odd] ^= 0x12;
      }
      const bool garbage = odd == 14 && all < 2;
      CHECK_EQ(motion.chip.read(motion.sample) == MpuStatus::kGarbage, garbage);
    }
  }
}

TEST_CASE("MPU: what it was set up with is asked at each sample by SPI, at every eighth over I2C") {
  for (uint8_t spi = 0; spi < 2; ++spi) {
    Motion motion;
    motion.bus.is_spi = spi != 0;
    REQUIRE(motion.start());
    uint8_t asked = 0;
    for (int16_t i = 0; i < 32; ++i) {
      motion.bus.count = 0;
      REQUIRE(motion.read({i, 2, 3, 4, 5, 6, 7}) == MpuStatus::kSample);
      CHECK(motion.bus.did(0, 0, 0x3B, 14, false));
      if (motion.bus.count == 2) {
        CHECK(motion.bus.did(1, 0, 0x1A, 3, false));
        CHECK((spi != 0 || i % 8 == 0));
        ++asked;
      }
    }
    CHECK_EQ(asked, spi != 0 ? 32 : 4);
    motion.bus.count = 0;
    motion.bus.fails = 1;
    CHECK(motion.read({9, 9, 9, 9, 9, 9, 8}) == MpuStatus::kGarbage);
    motion.bus.count = 0;
    motion.bus.fails = 0;
    CHECK(motion.read({9, 9, 9, 9, 9, 9, 8}) == MpuStatus::kBusError);
  }
}

TEST_CASE("MPU: twenty times the same is stuck, and the first other bytes are a sample") {
  Motion motion;
  REQUIRE(motion.start());
  for (uint8_t i = 0; i < 20; ++i) {
    CHECK(motion.read({1, 2, 3, 4, 5, 6, 7}) == MpuStatus::kSample);
  }
  for (uint16_t i = 0; i < 600; ++i) {
    CHECK(motion.read({1, 2, 3, 4, 5, 6, 7}) == MpuStatus::kStuck);
  }
  CHECK(motion.read({1, 2, 3, 4, 5, 6, 8}) == MpuStatus::kSample);
  for (uint8_t i = 0; i < 19; ++i) {
    CHECK(motion.read({1, 2, 3, 4, 5, 6, 8}) == MpuStatus::kSample);
  }
  CHECK(motion.read({1, 2, 3, 4, 5, 6, 8}) == MpuStatus::kStuck);
  motion.chip.set_dlpf(6);
  motion.chip.restart(motion.now_us);
  CHECK(!motion.chip.running());
  CHECK(!motion.after(499999));
  CHECK(!motion.after(1));
  CHECK(!motion.after(100000));
  CHECK(motion.after(35000));
  CHECK_EQ(motion.bus.registers[0x1A], 6);
}

namespace {

struct Field {
  Bus bus;
  drivers::Magnetometer<Bus> chip{bus};
  MagSample sample = {};
  uint32_t now_us = 0xFFFFFFFFU - 1000U;

  explicit Field(bool hmc) {
    bus.address = hmc ? 0x1E : 0x0D;
    if (hmc) {
      memcpy(bus.registers + 0x0A, "H43", 3);
    } else {
      bus.registers[0x0D] = 0xFF;
    }
  }
  bool after(uint32_t us) {
    now_us += us;
    return chip.poll(now_us, sample);
  }
  // To the first sample, which is thrown away.
  void start() {
    after(2000000);
    for (uint8_t i = 0; i < 5 && chip.chip() == MagChip::kNone; ++i) {
      after(1000);
    }
    after(66667);
  }
  // HMC: X, Z, Y, high byte first. QMC: X, Y, Z, low byte first.
  bool take(int16_t x, int16_t y, int16_t z) {
    const bool hmc = bus.address == 0x1E;
    const int16_t order[] = {x, hmc ? z : y, hmc ? y : z};
    for (uint8_t i = 0; i < 3; ++i) {
      const uint16_t word = static_cast<uint16_t>(order[i]);
      bus.registers[(hmc ? 3 : 0) + 2 * i + (hmc ? 0 : 1)] = static_cast<uint8_t>(word >> 8);
      bus.registers[(hmc ? 3 : 0) + 2 * i + (hmc ? 1 : 0)] = static_cast<uint8_t>(word);
    }
    return after(66667);
  }
};

}  // namespace

TEST_CASE("magnetometers: found and set up register by register, each at its time") {
  for (uint8_t hmc = 0; hmc < 2; ++hmc) {
    Field field(hmc != 0);
    Bus& bus = field.bus;
    const uint8_t address = hmc != 0 ? 0x1E : 0x0D;
    CHECK(!field.after(0));
    REQUIRE(bus.count == 1);
    CHECK(bus.did(0, 0x1E, 0x0A, 3, false));
    uint8_t at = 1;
    if (hmc == 0) {
      CHECK(!field.after(999));
      CHECK_EQ(bus.count, 1);
      CHECK(!field.after(1));
      CHECK(bus.did(at++, 0x0D, 0x0D, 1, false));
    }
    const uint8_t writes[2][3][2] = {{{0x0B, 0x01}, {0x0A, 0x01}, {0x09, 0x05}},
                                     {{0x00, 0x70}, {0x01, 0x20}, {0x02, 0x00}}};
    for (uint8_t i = 0; i < 3; ++i) {
      CHECK(field.chip.chip() == MagChip::kNone);
      CHECK(!field.after(999));
      CHECK_EQ(bus.count, at);
      CHECK(!field.after(1));
      CHECK(bus.did(at++, address, writes[hmc][i][0], writes[hmc][i][1], true));
    }
    CHECK(field.chip.chip() == (hmc != 0 ? MagChip::kHmc5883l : MagChip::kQmc5883l));
    CHECK(!field.after(66666));
    CHECK_EQ(bus.count, at);
    bus.registers[3] = 1;
    CHECK(!field.after(1));  // its gain is that of before
    CHECK(bus.did(at++, address, hmc != 0 ? 0x03 : 0x00, 6, false));
    CHECK(!field.after(66666));
    CHECK(field.after(1));
    CHECK_EQ(bus.count, at + 1);
  }
}

TEST_CASE("magnetometers: nobody there, or another's letters: both once a second") {
  for (uint8_t wrong = 0; wrong < 4; ++wrong) {
    Field field(wrong < 3);
    field.bus.registers[wrong < 3 ? 0x0A + wrong : 0x0D] ^= 1;
    field.after(0);
    field.after(1000);
    REQUIRE(field.bus.count == 2);
    CHECK(field.bus.did(0, 0x1E, 0x0A, 3, false));
    CHECK(field.bus.did(1, 0x0D, 0x0D, 1, false));
    field.after(999999);
    CHECK_EQ(field.bus.count, 2);
    field.after(1);
    CHECK(field.bus.did(2, 0x1E, 0x0A, 3, false));
    CHECK(field.chip.chip() == MagChip::kNone);
  }
}

TEST_CASE("magnetometers: a write that fails, or three reads in a row: looked for a second later") {
  for (uint8_t hmc = 0; hmc < 2; ++hmc) {
    for (uint8_t step = 0; step < 3; ++step) {
      Field field(hmc != 0);
      const uint8_t fails = static_cast<uint8_t>(step + (hmc != 0 ? 1 : 2));
      field.bus.fails = fails;
      while (field.bus.count <= fails) {
        field.after(1000);
      }
      const uint8_t before = static_cast<uint8_t>(field.bus.count);
      field.after(999999);
      CHECK_EQ(field.bus.count, before);
      field.after(1);
      CHECK(field.bus.did(before, 0x1E, 0x0A, 3, false));
      CHECK(field.chip.chip() == MagChip::kNone);
    }
    Field field(hmc != 0);
    field.start();
    CHECK(field.take(1, 2, 300));
    const uint8_t address = field.bus.address;
    for (uint8_t again = 0; again < 3; ++again) {
      field.bus.address = 0;
      CHECK(!field.take(1, 2, 3));
      CHECK(!field.take(1, 2, 3));
      field.bus.address = address;
      CHECK(field.take(again, 200, 300));
    }
    field.bus.address = 0;
    for (uint8_t i = 0; i < 3; ++i) {
      CHECK(field.chip.chip() != MagChip::kNone);
      CHECK(!field.take(1, 2, 3));
    }
    CHECK(field.chip.chip() == MagChip::kNone);
    field.bus.address = address;
    field.bus.count = 0;
    field.after(999999);
    CHECK_EQ(field.bus.count, 0);
    field.start();
    CHECK(field.take(7, 8, 9));
  }
}

TEST_CASE("magnetometers: found again, the first sample has the gain of before there too") {
  for (uint8_t hmc = 0; hmc < 2; ++hmc) {
    Field field(hmc != 0);
    field.start();
    CHECK(field.take(1, 2, 300));
    const uint8_t address = field.bus.address;
    field.bus.address = 0;
    for (uint8_t i = 0; i < 3; ++i) {
      CHECK(!field.take(1, 2, 300));
    }
    field.bus.address = address;
    field.after(1000000);
    for (uint8_t i = 0; i < 5 && field.chip.chip() == MagChip::kNone; ++i) {
      field.after(1000);
    }
    REQUIRE(field.chip.chip() != MagChip::kNone);
    CHECK(!field.take(1, 2, 400));
    CHECK(field.take(1, 2, 500));
  }
}

TEST_CASE("HMC5883L: letters above and below its own are another chip's") {
  for (uint8_t at = 0; at < 3; ++at) {
    for (int8_t off = -1; off <= 1; off = static_cast<int8_t>(off + 2)) {
      Field field(true);
      uint8_t& letter = field.bus.registers[0x0A + at];
      letter = static_cast<uint8_t>(letter + off);
      for (uint8_t i = 0; i < 6; ++i) {
        field.after(1000);
      }
      CHECK_EQ(field.bus.count, 2);  // both asked, and nothing set up
    }
  }
}

TEST_CASE("magnetometers: a chip that gives nought from its first sample on is none at the 30th") {
  Field field(true);
  field.start();  // the first
  for (uint8_t i = 2; i < 30; ++i) {
    CHECK(field.take(0, 0, 0));
  }
  CHECK(!field.take(0, 0, 0));
}

TEST_CASE("HMC5883L: twelve bits on every axis, what is beyond is none") {
  Field field(true);
  field.start();
  for (uint8_t axis = 0; axis < 3; ++axis) {
    const int16_t kept[] = {-2048, 2047};
    const int16_t refused[] = {-2049, 2048, -4096};
    int16_t values[3] = {10, 20, 30};
    for (const int16_t value : kept) {
      values[axis] = value;
      CHECK(field.take(values[0], values[1], values[2]));
      for (uint8_t i = 0; i < 3; ++i) {
        CHECK_EQ(field.sample.field[i], values[i]);
      }
    }
    for (const int16_t value : refused) {
      values[axis] = value;
      CHECK(!field.take(values[0], values[1], values[2]));
    }
  }
}

TEST_CASE("QMC5883L: 12000 counts a gauss become 1090 on every axis, both ends are none") {
  Field field(false);
  field.start();
  for (uint8_t axis = 0; axis < 3; ++axis) {
    const int16_t kept[][2] = {{12000, 1090},
                               {-12000, -1090},
                               {1200, 109},
                               {-1211, -109},
                               {32766, 2976},
                               {-32767, -2976},
                               {11, 0},
                               {12, 1}};
    for (const auto& one : kept) {
      int16_t values[3] = {1200, 2400, 3600};
      values[axis] = one[0];
      CHECK(field.take(values[0], values[1], values[2]));
      for (uint8_t i = 0; i < 3; ++i) {
        CHECK_EQ(field.sample.field[i], i == axis ? one[1] : 109 * (i + 1));
      }
    }
    int16_t values[3] = {1200, 2400, 3600};
    values[axis] = INT16_MAX;
    CHECK(!field.take(values[0], values[1], values[2]));
    values[axis] = INT16_MIN;
    CHECK(!field.take(values[0], values[1], values[2]));
  }
}

TEST_CASE("magnetometers: 30 times the same is none, and any axis that moves ends it") {
  for (uint8_t axis = 0; axis < 3; ++axis) {
    Field field(true);
    field.start();
    CHECK(field.take(5, 6, 7));
    for (uint8_t i = 1; i < 30; ++i) {
      CHECK(field.take(5, 6, 7));
    }
    for (uint16_t i = 0; i < 300; ++i) {
      CHECK(!field.take(5, 6, 7));
    }
    int16_t values[3] = {5, 6, 7};
    ++values[axis];
    CHECK(field.take(values[0], values[1], values[2]));
  }
}
