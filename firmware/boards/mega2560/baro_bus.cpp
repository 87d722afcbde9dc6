// The pressure sensor's own I2C bus on two port pins, open drain: a line is driven low or let go.
#include "hal/baro_bus.h"

#include <avr/io.h>
#include <util/delay.h>

#include "boards/mega2560/generated/pins.h"
#include "drivers/soft_i2c.h"
#include "hal/clock.h"

namespace {

struct Lines {
  static void sda(const bool released) { set<pins::BaroSda>(released); }
  static void scl(const bool released) { set<pins::BaroScl>(released); }
  static bool sda() { return (pins::BaroSda::input() & pins::BaroSda::kMask) != 0; }
  static bool scl() { return (pins::BaroScl::input() & pins::BaroScl::kMask) != 0; }
  static void half_bit() { _delay_us(1.5); }

 private:
  // Port A is within reach of sbi and cbi: no interrupt can come between.
  template <typename Pin>
  static void set(const bool released) {
    if (released) {
      Pin::direction() &= uint8_t(~Pin::kMask);
    } else {
      Pin::direction() |= Pin::kMask;
    }
  }
};

Lines g_lines;
drivers::SoftI2c<Lines> g_bus(g_lines);
uint8_t g_bytes[hal::kBaroBusBytes];

}  // namespace

namespace hal {

void start_baro_bus() {
  // The port latch stays low for ever; pull-ups to 3.3 V are on the sensor's board.
  pins::BaroSda::port() &= uint8_t(~pins::BaroSda::kMask);
  pins::BaroScl::port() &= uint8_t(~pins::BaroScl::kMask);
  Lines::sda(true);
  Lines::scl(true);
}

void baro_bus_write(const uint8_t address, const uint8_t reg, const uint8_t value) {
  g_bytes[0] = reg;
  g_bytes[1] = value;
  g_bus.start(address, g_bytes, 2, 0, now_us());
}

void baro_bus_read(const uint8_t address, const uint8_t reg, const uint8_t count) {
  g_bytes[0] = reg;
  g_bus.start(address, g_bytes, 1, count < kBaroBusBytes ? count : kBaroBusBytes, now_us());
}

BusStatus step_baro_bus() {
  switch (g_bus.poll(now_us())) {
    case drivers::BusStatus::kBusy:
      return BusStatus::kBusy;
    case drivers::BusStatus::kNack:
      return BusStatus::kNoAck;
    case drivers::BusStatus::kStuck:
      return BusStatus::kStuck;
    case drivers::BusStatus::kIdle:
    case drivers::BusStatus::kDone:
      break;
  }
  return BusStatus::kDone;
}

const uint8_t* baro_bus_bytes() {
  return g_bytes;
}

}  // namespace hal
