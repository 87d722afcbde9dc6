// The barometer on a bus that expects its transactions in order; then the bus master itself on a
// model of two wires.
#include <string.h>

#include "check.h"
#include "core/progmem.h"
#include "drivers/barometer.h"
#include "drivers/soft_i2c.h"

namespace {

using drivers::BaroEvent;
using drivers::BaroStatus;
using drivers::BusStatus;

struct Transaction {
  uint8_t address;
  uint8_t out[2];
  uint8_t out_size;
  uint8_t in[24];
  uint8_t in_size;
  BusStatus end;
};

// Coefficients of the datasheet's example, as they stand in the chip.
constexpr uint8_t kWords085[22] CORE_FLASH = {0x01, 0x98, 0xFF, 0xB8, 0xC7, 0xD1, 0x7F, 0xE5,
                                              0x7F, 0xF5, 0x5A, 0x71, 0x18, 0x2E, 0x00, 0x04,
                                              0x80, 0x00, 0xDD, 0xF9, 0x0B, 0x34};
constexpr uint8_t kWords280[24] CORE_FLASH = {0x70, 0x6B, 0x43, 0x67, 0x18, 0xFC, 0x7D, 0x8E,
                                              0x43, 0xD6, 0xD0, 0x0B, 0x27, 0x0B, 0x8C, 0x00,
                                              0xF9, 0xFF, 0x8C, 0x3C, 0xF8, 0xC6, 0x70, 0x17};

class ScriptedBus {
 public:
  Transaction script[12];
  uint8_t count = 0;
  uint8_t unexpected = 0;

  void expect(uint8_t address,
              uint8_t reg,
              const uint8_t* in_flash,
              uint8_t in_size,
              BusStatus end = BusStatus::kDone) {
    Transaction& next = script[count++];
    next = {address, {reg, 0}, 1, {}, in_size, end};
    core::flash_copy(next.in, in_flash, in_size);
  }
  void expect_bytes(uint8_t address, uint8_t reg, uint8_t a, uint8_t b, uint8_t c, uint8_t size) {
    script[count++] = {address, {reg, 0}, 1, {a, b, c}, size, BusStatus::kDone};
  }
  void expect_write(uint8_t address, uint8_t reg, uint8_t value) {
    script[count++] = {address, {reg, value}, 2, {}, 0, BusStatus::kDone};
  }
  bool finished() const { return at_ == count; }

  bool start(uint8_t address, uint8_t* buffer, uint8_t out_size, uint8_t in_size, uint32_t) {
    const Transaction& truth = script[at_ % 12];
    if (at_ >= count || truth.address != address || truth.out_size != out_size ||
        truth.in_size != in_size || memcmp(truth.out, buffer, out_size) != 0) {
      ++unexpected;
      return false;
    }
    buffer_ = buffer;
    turns_ = 3;  // busy for some polls
    return true;
  }
  BusStatus poll(uint32_t) {
    if (turns_ != 0) {
      --turns_;
      return BusStatus::kBusy;
    }
    const Transaction& truth = script[at_++ % 12];
    if (truth.end == BusStatus::kDone) {
      memcpy(buffer_, truth.in, truth.in_size);
    }
    return truth.end;
  }

 private:
  uint8_t* buffer_ = nullptr;
  uint8_t at_ = 0;
  uint8_t turns_ = 0;
};

struct Bench {
  ScriptedBus bus;
  drivers::Barometer<ScriptedBus> baro{bus};
  uint32_t now_us = 0xFFFFC000U;

  // The first event within the time.
  BaroEvent run_ms(uint16_t ms) {
    for (uint32_t turn = 0; turn < ms * 5U; ++turn) {
      now_us += 200;
      const BaroEvent event = baro.poll(now_us);
      if (event != BaroEvent::kNone) {
        return event;
      }
    }
    return BaroEvent::kNone;
  }
  void expect_085() {
    bus.expect_bytes(0x77, 0xD0, 0x55, 0, 0, 1);
    bus.expect(0x77, 0xAA, kWords085, 22);
  }
};

}  // namespace

TEST_CASE("BMP085: found, its coefficients kept, a measurement in two conversions") {
  Bench bench;
  bench.expect_085();
  REQUIRE(bench.run_ms(50) == BaroEvent::kFound);
  CHECK_EQ(bench.baro.chip_id(), 0x55);
  frames::BaroCoefficientsFrame coefficients;
  bench.baro.coefficients(coefficients);
  CHECK_EQ(coefficients.sensor, 1);
  CHECK_EQ(coefficients.oversampling, 2);
  const uint16_t ac1 = coefficients.words[0];
  const uint16_t md = coefficients.words[10];
  CHECK_EQ(ac1, 408);
  CHECK_EQ(md, 2868);

  CHECK(bench.run_ms(50) == BaroEvent::kNone);  // nothing until it is asked
  bench.bus.expect_write(0x77, 0xF4, 0x2E);
  bench.bus.expect_bytes(0x77, 0xF6, 0x6C, 0xFA, 0, 2);
  bench.bus.expect_write(0x77, 0xF4, 0xB4);
  bench.bus.expect_bytes(0x77, 0xF6, 0x5D, 0x23, 0x80, 3);
  bench.baro.measure();
  const uint32_t asked_us = bench.now_us;
  REQUIRE(bench.run_ms(50) == BaroEvent::kValue);
  const frames::BaroFrame& frame = bench.baro.frame();
  const uint32_t raw_temperature = frame.raw_temperature;
  const uint32_t raw_pressure = frame.raw_pressure;
  const uint32_t pressure = frame.static_pressure;
  const uint32_t t_us = frame.t_us;
  CHECK(raw_temperature == 27898U);
  CHECK(raw_pressure == 0x5D2380U >> 6);  // 23843 at oss 0 is 95374 here
  CHECK(pressure >= 69950U * 16);
  CHECK(pressure <= 69980U * 16);
  CHECK_EQ(frame.temperature, 1500);
  // In the middle of the second conversion, not when it was read.
  CHECK(t_us - asked_us > 10000U);
  CHECK(t_us - asked_us < 16000U);
  CHECK(bench.bus.finished());
  CHECK_EQ(bench.bus.unexpected, 0);
}

TEST_CASE("BMP280 at its other address: one forced conversion") {
  Bench bench;
  bench.bus.expect(0x77, 0xD0, kWords280, 1, BusStatus::kNack);
  bench.bus.expect_bytes(0x76, 0xD0, 0x58, 0, 0, 1);
  bench.bus.expect(0x76, 0x88, kWords280, 24);
  REQUIRE(bench.run_ms(1200) == BaroEvent::kFound);
  bench.bus.expect_write(0x76, 0xF4, 0b001'011'01);
  Transaction& data = bench.bus.script[bench.bus.count++];
  data = {0x76, {0xF7, 0}, 1, {0x65, 0x5A, 0xC0, 0x7E, 0xED, 0x00}, 6, BusStatus::kDone};
  bench.baro.measure();
  REQUIRE(bench.run_ms(50) == BaroEvent::kValue);
  const uint32_t raw_pressure = bench.baro.frame().raw_pressure;
  const uint32_t raw_temperature = bench.baro.frame().raw_temperature;
  CHECK(raw_pressure == 415148U);
  CHECK(raw_temperature == 519888U);
  CHECK_EQ(bench.baro.frame().temperature, 2508);
  CHECK_EQ(bench.baro.frame().sensor, 2);
  CHECK_EQ(bench.bus.unexpected, 0);
}

TEST_CASE("nobody there: asked once a second, never in a hurry") {
  Bench bench;
  for (uint8_t i = 0; i < 5; ++i) {
    bench.bus.expect(i % 2 == 0 ? 0x77 : 0x76, 0xD0, kWords280, 1, BusStatus::kNack);
  }
  CHECK(bench.run_ms(4500) == BaroEvent::kNone);
  CHECK(bench.bus.finished());
  CHECK(!bench.baro.present());
  CHECK(bench.baro.status() == BaroStatus::kSilent);
  CHECK_EQ(bench.baro.errors(), 5);
}

TEST_CASE("an unknown chip is refused") {
  Bench other;
  other.bus.expect_bytes(0x77, 0xD0, 0x60, 0, 0, 1);
  CHECK(other.run_ms(100) == BaroEvent::kNone);
  CHECK(other.baro.status() == BaroStatus::kOtherChip);
}

TEST_CASE("coefficients of a stuck chip are told once; raw values go on until they are right") {
  Bench stuck;
  stuck.bus.expect_bytes(0x77, 0xD0, 0x55, 0, 0, 1);
  stuck.bus.script[stuck.bus.count++] = {0x77, {0xAA, 0}, 1, {}, 22, BusStatus::kDone};
  CHECK(stuck.run_ms(100) == BaroEvent::kLost);
  CHECK(stuck.baro.status() == BaroStatus::kCoefficients);
  stuck.bus.expect_write(0x77, 0xF4, 0x2E);
  stuck.bus.expect_bytes(0x77, 0xF6, 0x6C, 0xFA, 0, 2);
  stuck.bus.expect_write(0x77, 0xF4, 0xB4);
  stuck.bus.expect_bytes(0x77, 0xF6, 0x5D, 0x23, 0x80, 3);
  stuck.baro.measure();
  REQUIRE(stuck.run_ms(50) == BaroEvent::kValue);
  const uint32_t raw_pressure = stuck.baro.frame().raw_pressure;
  const uint32_t pressure = stuck.baro.frame().static_pressure;
  CHECK(raw_pressure == 0x5D2380U >> 6);
  CHECK(pressure == frames::kBaroStaticPressureInvalid);
  CHECK_EQ(stuck.baro.frame().temperature, frames::kBaroTemperatureInvalid);
  stuck.bus.script[stuck.bus.count++] = {0x77, {0xAA, 0}, 1, {}, 22, BusStatus::kDone};
  CHECK(stuck.run_ms(1000) == BaroEvent::kNone);
  stuck.bus.expect(0x77, 0xAA, kWords085, 22);
  CHECK(stuck.run_ms(1000) == BaroEvent::kFound);
  CHECK_EQ(stuck.bus.unexpected, 0);
}

TEST_CASE("lost in the middle of a measurement, told once, found again") {
  Bench bench;
  bench.expect_085();
  REQUIRE(bench.run_ms(50) == BaroEvent::kFound);
  bench.bus.expect_write(0x77, 0xF4, 0x2E);
  bench.bus.script[bench.bus.count++] = {0x77, {0xF6, 0}, 1, {}, 2, BusStatus::kStuck};
  bench.baro.measure();
  REQUIRE(bench.run_ms(50) == BaroEvent::kLost);
  CHECK(bench.baro.status() == BaroStatus::kStuck);
  CHECK(!bench.baro.present());
  bench.bus.expect(0x76, 0xD0, kWords280, 1, BusStatus::kNack);
  bench.expect_085();
  CHECK(bench.run_ms(3000) == BaroEvent::kFound);
  CHECK_EQ(bench.bus.unexpected, 0);
}

namespace {

// A slave with one register file, as its two wires see it.
class Wires {
 public:
  uint8_t memory[8] = {0, 0x11, 0xA5, 0x33};
  uint8_t address = 0x77;
  bool sda_stuck = false;
  bool scl_stuck = false;
  uint8_t starts = 0;
  uint8_t stops = 0;
  uint16_t clocks = 0;

  void sda(bool released) {
    const bool before = sda();
    master_sda_ = released;
    if (scl_ && before && !sda()) {
      ++starts;
      bits_ = 0;
      phase_ = Phase::kAddress;
      slave_sda_ = true;
    } else if (scl_ && !before && sda()) {
      ++stops;
      phase_ = Phase::kOff;
    }
  }
  void scl(bool released) {
    if (released == scl_) {
      return;
    }
    scl_ = released;
    if (scl_) {
      ++clocks;
      rise();
    } else {
      fall();
    }
  }
  bool sda() const { return master_sda_ && slave_sda_ && !sda_stuck; }
  bool scl() const { return scl_ && !scl_stuck; }
  void half_bit() {}

 private:
  enum class Phase : uint8_t { kOff, kAddress, kPointer, kData, kRead };

  void rise() {
    if (bits_ < 8) {
      shift_ = static_cast<uint8_t>(shift_ << 1 | (sda() ? 1 : 0));
    } else if (phase_ == Phase::kRead) {
      more_ = !sda();
    }
    ++bits_;
  }
  // Behind the eighth bit the slave answers, behind the ninth it lets go or sends.
  void fall() {
    if (phase_ == Phase::kOff) {
      slave_sda_ = true;
      return;
    }
    if (bits_ == 8 && phase_ != Phase::kRead) {
      slave_sda_ = !take();
      return;
    }
    if (bits_ == 8) {
      slave_sda_ = true;
      return;
    }
    if (bits_ == 9) {
      bits_ = 0;
      slave_sda_ = true;
      if (phase_ == Phase::kRead && !more_) {
        phase_ = Phase::kOff;
        return;
      }
      if (phase_ == Phase::kRead) {
        out_ = memory[pointer_++ % 8];
      }
    }
    if (phase_ == Phase::kRead) {
      slave_sda_ = (out_ >> (7 - bits_) & 1) != 0;
    }
  }
  bool take() {
    switch (phase_) {
      case Phase::kAddress:
        if (shift_ >> 1 != address) {
          phase_ = Phase::kOff;
          return false;
        }
        phase_ = (shift_ & 1) != 0 ? Phase::kRead : Phase::kPointer;
        more_ = true;
        return true;
      case Phase::kPointer:
        pointer_ = shift_;
        phase_ = Phase::kData;
        return true;
      case Phase::kData:
        memory[pointer_++ % 8] = shift_;
        return true;
      case Phase::kOff:
      case Phase::kRead:
        break;
    }
    return false;
  }

  Phase phase_ = Phase::kOff;
  uint8_t bits_ = 0;
  uint8_t shift_ = 0;
  uint8_t out_ = 0;
  uint8_t pointer_ = 0;
  bool master_sda_ = true;
  bool slave_sda_ = true;
  bool scl_ = true;
  bool more_ = true;
};

struct Master {
  Wires wires;
  drivers::SoftI2c<Wires> bus{wires};
  uint8_t buffer[4] = {};
  uint32_t now_us = 0xFFFFFF00U;
  uint16_t most_clocks = 0;  // in one poll

  BusStatus run() {
    for (uint8_t turn = 0; turn < 100; ++turn) {
      now_us += 100;
      const uint16_t before = wires.clocks;
      const BusStatus status = bus.poll(now_us);
      const uint16_t clocks = static_cast<uint16_t>(wires.clocks - before);
      most_clocks = clocks > most_clocks ? clocks : most_clocks;
      if (status != BusStatus::kBusy) {
        return status;
      }
    }
    return BusStatus::kBusy;
  }
};

}  // namespace

TEST_CASE("the bus master reads registers behind a repeated start, one byte per poll") {
  Master master;
  master.buffer[0] = 1;
  REQUIRE(master.bus.start(0x77, master.buffer, 1, 3, master.now_us));
  CHECK(!master.bus.start(0x77, master.buffer, 1, 3, master.now_us));
  CHECK(master.run() == BusStatus::kDone);
  CHECK_EQ(master.buffer[0], 0x11);
  CHECK_EQ(master.buffer[1], 0xA5);
  CHECK_EQ(master.buffer[2], 0x33);
  CHECK_EQ(master.wires.starts, 2);
  CHECK_EQ(master.wires.stops, 1);
  CHECK(master.most_clocks <= 10);
  CHECK(master.wires.sda());
}

TEST_CASE("the bus master writes a register") {
  Master master;
  master.buffer[0] = 5;
  master.buffer[1] = 0xC3;
  master.bus.start(0x77, master.buffer, 2, 0, master.now_us);
  CHECK(master.run() == BusStatus::kDone);
  CHECK_EQ(master.wires.memory[5], 0xC3);
  CHECK_EQ(master.wires.stops, 1);
}

TEST_CASE("nobody acknowledges: told at once, the bus left free") {
  Master master;
  master.wires.address = 0x76;
  master.bus.start(0x77, master.buffer, 1, 2, master.now_us);
  CHECK(master.run() == BusStatus::kNack);
  CHECK_EQ(master.wires.stops, 1);
  CHECK(master.wires.scl());
}

TEST_CASE("a stuck line costs 2 ms and nine clocks, then the bus works again") {
  for (uint8_t line = 0; line < 2; ++line) {
    Master master;
    (line == 0 ? master.wires.sda_stuck : master.wires.scl_stuck) = true;
    const uint32_t from_us = master.now_us;
    master.bus.start(0x77, master.buffer, 1, 1, master.now_us);
    CHECK(master.run() == BusStatus::kStuck);
    CHECK(master.now_us - from_us <= 2300U);
    CHECK(master.wires.clocks >= 9);
    master.wires.sda_stuck = false;
    master.wires.scl_stuck = false;
    master.buffer[0] = 2;
    REQUIRE(master.bus.start(0x77, master.buffer, 1, 1, master.now_us));
    CHECK(master.run() == BusStatus::kDone);
    CHECK_EQ(master.buffer[0], 0xA5);
  }
}
