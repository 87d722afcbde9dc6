// Every transaction of the barometer with its instant; every level of the two wires with its time.
#include <string.h>

#include "check.h"
#include "drivers/barometer.h"
#include "drivers/soft_i2c.h"

namespace {

using drivers::BaroEvent;
using drivers::BaroStatus;
using drivers::BusStatus;

constexpr uint8_t kWords085[22] = {0x01, 0x98, 0xFF, 0xB8, 0xC7, 0xD1, 0x7F, 0xE5,
                                   0x7F, 0xF5, 0x5A, 0x71, 0x18, 0x2E, 0x00, 0x04,
                                   0x80, 0x00, 0xDD, 0xF9, 0x0B, 0x34};
constexpr uint8_t kWords280[24] = {0x70, 0x6B, 0x43, 0x67, 0x18, 0xFC, 0x7D, 0x8E,
                                   0x43, 0xD6, 0xD0, 0x0B, 0x27, 0x0B, 0x8C, 0x00,
                                   0xF9, 0xFF, 0x8C, 0x3C, 0xF8, 0xC6, 0x70, 0x17};
constexpr uint8_t kData280[6] = {0x65, 0x5A, 0xC0, 0x7E, 0xED, 0x00};

// Answers with what the test has laid ready; every start is kept.
struct Bus {
  uint8_t* buffer = nullptr;
  const uint8_t* answer = nullptr;
  BusStatus status = BusStatus::kBusy;
  uint8_t address = 0, out[2] = {}, out_size = 0, in_size = 0;
  uint16_t starts = 0;

  bool start(uint8_t to, uint8_t* bytes, uint8_t sent, uint8_t wanted, uint32_t) {
    ++starts;
    buffer = bytes;
    address = to;
    out_size = sent;
    in_size = wanted;
    memcpy(out, bytes, sent);
    status = BusStatus::kBusy;
    return true;
  }
  BusStatus poll(uint32_t) {
    if (status == BusStatus::kDone && in_size != 0) {
      memcpy(buffer, answer, in_size);
    }
    return status;
  }
};

struct Bench {
  Bus bus;
  drivers::Barometer<Bus> baro{bus};
  uint32_t now_us = 0xFFFFFFFFU - 4000U;

  BaroEvent after(uint32_t us = 0) {
    now_us += us;
    return baro.poll(now_us);
  }
  bool asks(uint8_t address, uint8_t reg, uint8_t size) const {
    return bus.address == address && bus.out_size == 1 && bus.out[0] == reg && bus.in_size == size;
  }
  bool writes(uint8_t address, uint8_t value) const {
    return bus.address == address && bus.out_size == 2 && bus.out[0] == 0xF4 &&
           bus.out[1] == value && bus.in_size == 0;
  }
  BaroEvent answer(const uint8_t* bytes) {
    bus.answer = bytes;
    bus.status = BusStatus::kDone;
    const BaroEvent event = after();
    return event;
  }
  BaroEvent fail(BusStatus status) {
    bus.status = status;
    return after();
  }
  void find(uint8_t chip) {
    after();
    CHECK(answer(&chip) == BaroEvent::kNone);
    CHECK(answer(chip == 0x55 ? kWords085 : kWords280) == BaroEvent::kFound);
  }
};

}  // namespace

TEST_CASE("barometer: asked at once, then each second at the other address") {
  Bench bench;
  for (uint8_t i = 0; i < 6; ++i) {
    CHECK(bench.after() == BaroEvent::kNone);
    CHECK_EQ(bench.bus.starts, i + 1);
    CHECK(bench.asks(i % 2 == 0 ? 0x77 : 0x76, 0xD0, 1));
    CHECK(bench.after(5) == BaroEvent::kNone);
    CHECK(bench.fail(i < 3 ? BusStatus::kNack : BusStatus::kStuck) == BaroEvent::kNone);
    CHECK(bench.baro.status() == (i < 3 ? BaroStatus::kSilent : BaroStatus::kStuck));
    CHECK_EQ(bench.baro.errors(), i + 1);
    CHECK(!bench.baro.present());
    CHECK(bench.after(999999) == BaroEvent::kNone);
    CHECK_EQ(bench.bus.starts, i + 1);
    bench.now_us += 1;
  }
  const uint8_t others[] = {0x00, 0x54, 0x56, 0x57, 0x59, 0x60, 0xFF};
  for (const uint8_t chip : others) {
    bench.after();
    CHECK(bench.answer(&chip) == BaroEvent::kNone);
    CHECK(bench.baro.status() == BaroStatus::kOtherChip);
    CHECK(!bench.baro.present());
    bench.now_us += 1000000;
  }
}

TEST_CASE("barometer: asked at once at power-on too, when the clock has just begun") {
  Bench bench;
  bench.now_us = 0;
  CHECK(bench.after(12) == BaroEvent::kNone);
  CHECK_EQ(bench.bus.starts, 1);
  CHECK(bench.asks(0x77, 0xD0, 1));
}

TEST_CASE("barometer: the numbers by which the log tells why it is lost") {
  CHECK_EQ(static_cast<uint8_t>(BaroStatus::kOk), 0);
  CHECK_EQ(static_cast<uint8_t>(BaroStatus::kSilent), 1);
  CHECK_EQ(static_cast<uint8_t>(BaroStatus::kStuck), 2);
  CHECK_EQ(static_cast<uint8_t>(BaroStatus::kOtherChip), 3);
  CHECK_EQ(static_cast<uint8_t>(BaroStatus::kCoefficients), 4);
}

TEST_CASE("barometer: a BMP085's measurement, both commands and waits of its data sheet") {
  Bench bench;
  bench.baro.measure();  // before there is one: forgotten
  bench.find(0x55);
  CHECK(bench.asks(0x77, 0xAA, 22));
  CHECK(bench.baro.present());
  CHECK(bench.baro.status() == BaroStatus::kOk);
  CHECK_EQ(bench.baro.chip_id(), 0x55);
  frames::BaroCoefficientsFrame told = {};
  bench.baro.coefficients(told);
  CHECK_EQ(told.sensor, 1);
  CHECK_EQ(told.oversampling, 2);
  for (uint8_t i = 0; i < 11; ++i) {
    const uint16_t word = told.words[i];
    CHECK_EQ(word, kWords085[2 * i] << 8 | kWords085[2 * i + 1]);
  }
  CHECK_EQ(told.words[11], 0);
  const uint16_t before = bench.bus.starts;
  CHECK(bench.after(100) == BaroEvent::kNone);
  CHECK(bench.after(5000000) == BaroEvent::kNone);
  CHECK_EQ(bench.bus.starts, before);
  bench.baro.measure();
  CHECK(bench.after(10) == BaroEvent::kNone);
  CHECK(bench.writes(0x77, 0x2E));
  CHECK(bench.answer(nullptr) == BaroEvent::kNone);
  CHECK(bench.after(4949) == BaroEvent::kNone);
  CHECK(bench.writes(0x77, 0x2E));
  CHECK(bench.after(1) == BaroEvent::kNone);
  CHECK(bench.asks(0x77, 0xF6, 2));
  const uint8_t temperature[] = {0x6C, 0xFA};
  CHECK(bench.answer(temperature) == BaroEvent::kNone);
  CHECK(bench.writes(0x77, 0xB4));
  bench.now_us += 300;
  CHECK(bench.answer(nullptr) == BaroEvent::kNone);
  const uint32_t began_us = bench.now_us;
  CHECK(bench.after(14849) == BaroEvent::kNone);
  CHECK(bench.writes(0x77, 0xB4));
  CHECK(bench.after(1) == BaroEvent::kNone);
  CHECK(bench.asks(0x77, 0xF6, 3));
  const uint8_t pressure[] = {0x5D, 0x23, 0xC0};
  CHECK(bench.after(77) == BaroEvent::kNone);
  CHECK(bench.answer(pressure) == BaroEvent::kValue);
  const frames::BaroFrame frame = bench.baro.frame();
  CHECK_EQ(frame.t_us, began_us + 6750);
  CHECK_EQ(frame.raw_temperature, 27898U);
  CHECK_EQ(frame.raw_pressure, 0x5D23C0U >> 6);
  CHECK_EQ(frame.temperature, 1500);
  uint16_t words[12];
  memcpy(words, told.words, sizeof(words));
  const core::BaroValue value = core::bmp085_compensate(words, 2, 27898, 0x5D23C0U >> 6);
  CHECK_EQ(frame.static_pressure, value.static_pressure);
  CHECK_EQ(frame.sensor, 1);
  // One for each time it is asked, and once if asked in between.
  bench.baro.measure();
  bench.after();
  bench.baro.measure();
  bench.answer(nullptr);
  bench.after(4950);
  bench.answer(temperature);
  bench.answer(nullptr);
  bench.after(14850);
  CHECK(bench.answer(pressure) == BaroEvent::kValue);
  bench.after();
  CHECK(bench.writes(0x77, 0x2E));
}

TEST_CASE("barometer: a BMP280's one conversion, its words and its middle") {
  Bench bench;
  bench.find(0x58);
  CHECK(bench.asks(0x77, 0x88, 24));
  CHECK_EQ(bench.baro.chip_id(), 0x58);
  frames::BaroCoefficientsFrame told = {};
  bench.baro.coefficients(told);
  CHECK_EQ(told.sensor, 2);
  CHECK_EQ(told.oversampling, 3);
  for (uint8_t i = 0; i < 12; ++i) {
    const uint16_t word = told.words[i];
    CHECK_EQ(word, kWords280[2 * i + 1] << 8 | kWords280[2 * i]);
  }
  bench.baro.measure();
  bench.after();
  CHECK(bench.writes(0x77, 0x2D));
  bench.answer(nullptr);
  const uint32_t began_us = bench.now_us;
  bench.after(14499);
  CHECK(bench.writes(0x77, 0x2D));
  bench.after(1);
  CHECK(bench.asks(0x77, 0xF7, 6));
  CHECK(bench.answer(kData280) == BaroEvent::kValue);
  const frames::BaroFrame frame = bench.baro.frame();
  CHECK_EQ(frame.t_us, began_us + 7250);
  CHECK_EQ(frame.raw_pressure, 415148U);
  CHECK_EQ(frame.raw_temperature, 519888U);
  CHECK_EQ(frame.temperature, 2508);
  CHECK_EQ(frame.sensor, 2);
}

TEST_CASE("barometer: coefficients that no chip has are read again each second, told once") {
  for (uint8_t chip = 0x55; chip <= 0x58; chip = static_cast<uint8_t>(chip + 3)) {
    const uint8_t zeros[24] = {};
    const uint8_t size = chip == 0x55 ? 22 : 24;
    const uint8_t reg = chip == 0x55 ? 0xAA : 0x88;
    Bench bench;
    bench.after();
    bench.answer(&chip);
    CHECK(bench.answer(zeros) == BaroEvent::kLost);
    CHECK(bench.baro.present());
    for (uint8_t i = 1; i < 4; ++i) {
      CHECK(bench.baro.status() == BaroStatus::kCoefficients);
      CHECK_EQ(bench.baro.errors(), i);
      const uint16_t before = bench.bus.starts;
      bench.after(999999);
      CHECK_EQ(bench.bus.starts, before);
      bench.after(1);
      CHECK(bench.asks(0x77, reg, size));
      CHECK(bench.answer(zeros) == BaroEvent::kNone);
    }
    bench.baro.measure();
    bench.after();
    bench.answer(nullptr);
    bench.after(14850);
    BaroEvent event = bench.answer(kData280);
    if (chip == 0x55) {
      bench.answer(nullptr);
      bench.after(14850);
      event = bench.answer(kData280);
    }
    CHECK(event == BaroEvent::kValue);
    CHECK_EQ(bench.baro.frame().static_pressure, frames::kBaroStaticPressureInvalid);
    CHECK_EQ(bench.baro.frame().temperature, frames::kBaroTemperatureInvalid);
    bench.after(1000000);
    CHECK(bench.asks(0x77, reg, size));
    CHECK(bench.answer(chip == 0x55 ? kWords085 : kWords280) == BaroEvent::kFound);
    CHECK(bench.baro.status() == BaroStatus::kOk);
    const uint16_t before = bench.bus.starts;
    bench.after(5000000);
    CHECK_EQ(bench.bus.starts, before);
  }
}

TEST_CASE("barometer: lost at any transaction it is told once it was there, and sought elsewhere") {
  for (uint8_t at = 0; at < 6; ++at) {
    Bench bench;
    bench.after();
    const uint8_t chip = 0x55;
    const uint32_t waits_us[] = {0, 0, 0, 4950, 0, 14850};
    const uint8_t* const answers[] = {&chip, kWords085, nullptr, kWords085, nullptr, kWords085};
    for (uint8_t i = 0; i < at; ++i) {
      bench.after(waits_us[i]);
      bench.answer(answers[i]);
      if (i == 1) {
        bench.baro.measure();
        bench.after();
      }
    }
    bench.after(waits_us[at]);
    CHECK(bench.fail(BusStatus::kNack) == (at < 2 ? BaroEvent::kNone : BaroEvent::kLost));
    CHECK(bench.baro.status() == BaroStatus::kSilent);
    CHECK(!bench.baro.present());
    CHECK_EQ(bench.baro.errors(), 1);
    const uint16_t before = bench.bus.starts;
    bench.after(999999);
    CHECK_EQ(bench.bus.starts, before);
    bench.after(1);
    CHECK(bench.asks(0x76, 0xD0, 1));
  }
  Bench bench;
  for (uint32_t i = 0; i < 65540; ++i) {
    bench.after(1000000);
    bench.fail(BusStatus::kNack);
  }
  CHECK_EQ(bench.baro.errors(), 0xFFFF);
}

namespace {

// Two open-drain lines that keep UM10204's rules: what moves when, and for how long. A slave that
// acknowledges what it is told to and sends ones and zeros of a pattern.
struct Lines {
  bool sda_out = true, scl_out = true;
  bool slave_sda = true;
  bool sda_stuck = false, scl_stuck = false;
  uint16_t halves = 1;  // half bits since a line moved last
  uint16_t broken = 0;
  uint16_t clocks = 0, starts = 0, stops = 0;
  uint8_t bits = 0;
  uint8_t bytes[12];  // as they went over the wire
  bool acks[12];
  uint8_t count = 0;
  uint8_t shift = 0;
  uint8_t refuses = 0xFF;  // the byte with this number is not acknowledged
  uint8_t pattern = 0;     // what is sent when read
  bool reads = false;

  bool sda() const { return sda_out && slave_sda && !sda_stuck; }
  bool scl() const { return scl_out && !scl_stuck; }
  void half_bit() { ++halves; }

  void sda(bool released) {
    const bool before = sda();
    sda_out = released;
    if (sda() == before || !scl_out) {
      return;
    }
    // Set-up and hold of START and STOP, and the bus free between the two.
    broken = static_cast<uint16_t>(broken + (halves == 0));
    halves = 0;
    if (before) {
      ++starts;
      bits = 0;
      reads = false;
      began = true;
    } else {
      ++stops;
      began = false;
    }
  }
  void scl(bool released) {
    if (released == scl_out) {
      return;
    }
    broken = static_cast<uint16_t>(broken + (halves == 0));
    halves = 0;
    scl_out = released;
    if (released) {
      ++clocks;
      rise();
    } else {
      fall();
    }
  }

 private:
  bool began = false;

  void rise() {
    if (!began) {
      return;
    }
    if (bits < 8) {
      shift = static_cast<uint8_t>(shift << 1 | (sda() ? 1 : 0));
    } else if (count < 12) {
      bytes[count] = shift;
      acks[count] = !sda();
      ++count;
    }
    ++bits;
  }
  void fall() {
    if (!began) {
      slave_sda = true;
      return;
    }
    if (bits == 9) {
      if (!acks[count - 1]) {  // of either side: the slave is out of it
        began = false;
        slave_sda = true;
        return;
      }
      reads = reads || ((shift & 1) != 0 && starts % 2 == 0);
      bits = 0;
    }
    if (reads) {
      slave_sda = bits == 8 || (static_cast<uint8_t>(pattern + count) >> (7 - bits) & 1) != 0;
    } else {
      slave_sda = bits != 8 || count == refuses;
    }
  }
};

struct Master {
  Lines lines;
  drivers::SoftI2c<Lines> bus{lines};
  uint8_t buffer[4] = {0x12, 0xED, 0x80, 0x01};
  uint32_t now_us = 0xFFFFFFFFU - 700U;

  BusStatus run() {
    BusStatus status = BusStatus::kBusy;
    for (uint8_t turn = 0; turn < 30 && status == BusStatus::kBusy; ++turn) {
      now_us += 100;
      status = bus.poll(now_us);
    }
    return status;
  }
  bool rests() const { return lines.sda() && lines.scl() && lines.halves != 0; }
};

}  // namespace

TEST_CASE("bus: what is written goes over the wire bit by bit, by the rules of UM10204") {
  for (uint8_t size = 1; size <= 4; ++size) {
    Master master;
    CHECK(master.bus.poll(0) == BusStatus::kIdle);
    REQUIRE(master.bus.start(0x55, master.buffer, size, 0, master.now_us));
    CHECK(!master.bus.start(0x11, master.buffer, 1, 1, master.now_us));
    CHECK(master.run() == BusStatus::kDone);
    CHECK(master.bus.poll(master.now_us) == BusStatus::kDone);
    REQUIRE(master.lines.count == size + 1);
    CHECK_EQ(master.lines.bytes[0], 0xAA);
    const uint8_t sent[] = {0x12, 0xED, 0x80, 0x01};
    CHECK_EQ(memcmp(master.lines.bytes + 1, sent, size), 0);
    CHECK_EQ(master.lines.starts, 1);
    CHECK_EQ(master.lines.stops, 1);
    CHECK_EQ(master.lines.clocks, 9 * (size + 1) + 1);
    CHECK_EQ(master.lines.broken, 0);
    CHECK(master.rests());
  }
}

TEST_CASE("bus: what is read comes behind a repeated start; the last byte is not acknowledged") {
  for (uint8_t size = 1; size <= 4; ++size) {
    for (uint16_t pattern = 0; pattern < 256; pattern = static_cast<uint16_t>(pattern + 17)) {
      Master master;
      master.lines.pattern = static_cast<uint8_t>(pattern);
      master.bus.start(0x2A, master.buffer, 1, size, master.now_us);
      CHECK(master.run() == BusStatus::kDone);
      REQUIRE(master.lines.count == size + 3);
      CHECK_EQ(master.lines.bytes[0], 0x54);
      CHECK_EQ(master.lines.bytes[1], 0x12);
      CHECK_EQ(master.lines.bytes[2], 0x55);
      for (uint8_t i = 0; i < size; ++i) {
        CHECK_EQ(master.buffer[i], static_cast<uint8_t>(pattern + 3 + i));
        CHECK_EQ(master.lines.acks[3 + i], i + 1 < size);
      }
      CHECK_EQ(master.lines.starts, 2);
      CHECK_EQ(master.lines.stops, 1);
      CHECK_EQ(master.lines.clocks, 9 * (size + 3) + 2);
      CHECK_EQ(master.lines.broken, 0);
      CHECK(master.rests());
    }
  }
}

TEST_CASE("bus: whichever byte is not acknowledged ends it with a stop") {
  for (uint8_t refused = 0; refused < 4; ++refused) {
    Master master;
    master.lines.refuses = refused;
    master.bus.start(0x55, master.buffer, 3, 0, master.now_us);
    CHECK(master.run() == BusStatus::kNack);
    CHECK_EQ(master.lines.count, refused + 1);
    CHECK_EQ(master.lines.stops, 1);
    CHECK_EQ(master.lines.broken, 0);
    CHECK(master.rests());
    // And it can begin again.
    Master again;
    again.lines.refuses = refused;
    again.bus.start(0x55, again.buffer, 2, 1, again.now_us);
    CHECK(again.run() == BusStatus::kNack);
    again.lines.refuses = 0xFF;
    again.lines.count = 0;
    again.lines.starts = 0;
    CHECK(again.bus.start(0x55, again.buffer, 1, 0, again.now_us));
    CHECK(again.run() == BusStatus::kDone);
  }
}

TEST_CASE("bus: a line that is low for 2 ms and a microsecond is stuck; nine clocks and a stop") {
  for (uint8_t line = 0; line < 2; ++line) {
    Master master;
    bool& stuck = line == 0 ? master.lines.sda_stuck : master.lines.scl_stuck;
    stuck = true;
    master.bus.start(0x55, master.buffer, 2, 0, master.now_us);
    CHECK(master.bus.poll(master.now_us + 1) == BusStatus::kBusy);
    CHECK(master.bus.poll(master.now_us + 2000) == BusStatus::kBusy);
    CHECK_EQ(master.lines.clocks, 0);
    CHECK(master.bus.poll(master.now_us + 2001) == BusStatus::kStuck);
    CHECK_EQ(master.lines.clocks, 10);
    CHECK_EQ(master.lines.broken, 0);
    CHECK(master.bus.poll(master.now_us + 2002) == BusStatus::kStuck);
    stuck = false;
    CHECK(master.rests());
  }
  // A clock held between two bytes counts from the last one; data low there is an acknowledge.
  Master master;
  master.bus.start(0x55, master.buffer, 3, 0, master.now_us);
  CHECK(master.bus.poll(master.now_us + 1500) == BusStatus::kBusy);
  CHECK_EQ(master.lines.count, 1);
  master.lines.scl_stuck = true;
  CHECK(master.bus.poll(master.now_us + 3500) == BusStatus::kBusy);
  master.lines.scl_stuck = false;
  CHECK(master.bus.poll(master.now_us + 3501) == BusStatus::kBusy);
  CHECK_EQ(master.lines.count, 2);
  master.lines.scl_stuck = true;
  CHECK(master.bus.poll(master.now_us + 5501) == BusStatus::kBusy);
  CHECK(master.bus.poll(master.now_us + 5502) == BusStatus::kStuck);
}
