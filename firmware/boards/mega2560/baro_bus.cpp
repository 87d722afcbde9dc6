// The pressure sensor's own I2C bus on two port pins, open drain: a line is driven low or let go.
#include "hal/baro_bus.h"

#include <avr/io.h>
#include <util/delay.h>

#include "boards/mega2560/generated/pins.h"

namespace {

// 2 us and the instructions around it: about 170 kHz, within the 400 kHz of BMP085 and BMP280.
constexpr double kQuarterUs = 1.0;

void half_bit() {
  _delay_us(2 * kQuarterUs);
}

void sda_low() {
  pins::BaroSda::direction() |= pins::BaroSda::kMask;
}
void sda_free() {
  pins::BaroSda::direction() &= uint8_t(~pins::BaroSda::kMask);
}
void scl_low() {
  pins::BaroScl::direction() |= pins::BaroScl::kMask;
}
void scl_free() {
  pins::BaroScl::direction() &= uint8_t(~pins::BaroScl::kMask);
}
bool sda_is_high() {
  return (pins::BaroSda::input() & pins::BaroSda::kMask) != 0;
}
bool scl_is_high() {
  return (pins::BaroScl::input() & pins::BaroScl::kMask) != 0;
}

enum class Step : uint8_t {
  kIdle,
  kStart,
  kAddressWrite,
  kRegister,
  kValue,
  kRestart,
  kAddressRead,
  kRead,
  kStop,
};

Step g_step = Step::kIdle;
hal::BusStatus g_status = hal::BusStatus::kDone;
hal::BusStatus g_result = hal::BusStatus::kDone;
uint8_t g_address;
uint8_t g_register;
uint8_t g_value;
uint8_t g_count;  // bytes to read; 0 for a write
uint8_t g_read;
uint8_t g_bytes[hal::kBaroBusBytes];

bool clock_pulse() {
  half_bit();
  scl_free();
  half_bit();
  const bool high = sda_is_high();
  scl_low();
  return high;
}

bool send(uint8_t byte) {
  for (uint8_t bit = 0; bit < 8; ++bit) {
    if ((byte & 0x80U) != 0) {
      sda_free();
    } else {
      sda_low();
    }
    byte = uint8_t(byte << 1);
    clock_pulse();
  }
  sda_free();
  return !clock_pulse();  // acknowledged: held low
}

uint8_t receive(const bool last) {
  uint8_t byte = 0;
  sda_free();
  for (uint8_t bit = 0; bit < 8; ++bit) {
    byte = uint8_t((byte << 1) | (clock_pulse() ? 1U : 0U));
  }
  if (!last) {
    sda_low();
  }
  clock_pulse();
  sda_free();
  return byte;
}

bool start_condition() {
  sda_free();
  half_bit();
  scl_free();
  half_bit();
  if (!scl_is_high() || !sda_is_high()) {
    return false;
  }
  sda_low();
  half_bit();
  scl_low();
  return true;
}

void stop_condition() {
  sda_low();
  half_bit();
  scl_free();
  half_bit();
  sda_free();
  half_bit();
}

// A sensor that lost a clock holds SDA for the rest of its byte: nine clocks and a STOP free it.
void free_bus() {
  sda_free();
  for (uint8_t pulse = 0; pulse < 9 && !sda_is_high(); ++pulse) {
    clock_pulse();
  }
  stop_condition();
}

void fail(const hal::BusStatus why) {
  g_result = why;
  g_step = Step::kStop;
}

void send_step(const uint8_t byte, const Step next) {
  if (send(byte)) {
    g_step = next;
  } else {
    fail(hal::BusStatus::kNoAck);
  }
}

void begin(const uint8_t address, const uint8_t reg) {
  g_address = uint8_t(address << 1);
  g_register = reg;
  g_read = 0;
  g_status = hal::BusStatus::kBusy;
  g_result = hal::BusStatus::kDone;
  g_step = Step::kStart;
}

}  // namespace

namespace hal {

void start_baro_bus() {
  // The port latch stays low for ever; pull-ups to 3.3 V are on the sensor's board.
  pins::BaroSda::port() &= uint8_t(~pins::BaroSda::kMask);
  pins::BaroScl::port() &= uint8_t(~pins::BaroScl::kMask);
  sda_free();
  scl_free();
}

void baro_bus_write(const uint8_t address, const uint8_t reg, const uint8_t value) {
  begin(address, reg);
  g_value = value;
  g_count = 0;
}

void baro_bus_read(const uint8_t address, const uint8_t reg, const uint8_t count) {
  begin(address, reg);
  g_count = count < kBaroBusBytes ? count : kBaroBusBytes;
}

BusStatus step_baro_bus() {
  switch (g_step) {
    case Step::kIdle:
      break;
    case Step::kStart:
      if (start_condition()) {
        g_step = Step::kAddressWrite;
      } else {
        free_bus();
        g_step = Step::kIdle;
        g_status = BusStatus::kStuck;
      }
      break;
    case Step::kAddressWrite:
      send_step(g_address, Step::kRegister);
      break;
    case Step::kRegister:
      send_step(g_register, g_count == 0 ? Step::kValue : Step::kRestart);
      break;
    case Step::kValue:
      send_step(g_value, Step::kStop);
      break;
    case Step::kRestart:
      if (start_condition()) {
        g_step = Step::kAddressRead;
      } else {
        fail(BusStatus::kStuck);
      }
      break;
    case Step::kAddressRead:
      send_step(uint8_t(g_address | 1U), Step::kRead);
      break;
    case Step::kRead: {
      const bool last = g_read + 1 == g_count;
      g_bytes[g_read] = receive(last);
      ++g_read;
      if (last) {
        g_step = Step::kStop;
      }
      break;
    }
    case Step::kStop:
      stop_condition();
      g_step = Step::kIdle;
      g_status = g_result;
      break;
  }
  return g_status;
}

const uint8_t* baro_bus_bytes() {
  return g_bytes;
}

}  // namespace hal
