// SPI at 1 MHz, mode 3: all registers of the MPU-6000 allow that (PS-MPU-6000A, section 6.5).
#include "boards/arduimu/sensor_bus.h"

#include <avr/io.h>

#include "boards/arduimu/board.h"
#include "boards/arduimu/twi_master.h"
#include "boards/avr/spi.h"

namespace arduimu {
namespace {

constexpr uint8_t kMpuAddress = 0x68;  // AD0 low
constexpr uint8_t kBiggest = 16;

class Selected {
 public:
  Selected() { PORTD &= uint8_t(~kSelect); }
  ~Selected() { PORTD |= kSelect; }
  Selected(const Selected&) = delete;
  Selected& operator=(const Selected&) = delete;
};

constexpr uint8_t kPolls = 40;  // a byte: 128 cycles

void set_control() {
  SPCR = _BV(SPE) | _BV(MSTR) | _BV(CPOL) | _BV(CPHA) | _BV(SPR0);  // 16 MHz / 16
  SPSR = 0;
}

uint8_t exchange(const uint8_t out) {
  SPDR = out;
  if (avr::spi_ended(kPolls)) {
    return SPDR;
  }
  set_control();
  return 0xFF;
}

bool read_twi(uint8_t address, uint8_t reg, uint8_t* out, uint8_t size) {
  uint8_t buffer[kBiggest];
  buffer[0] = reg;
  if (size > kBiggest || transfer(address, buffer, 1, size) != TwiStatus::kDone) {
    return false;
  }
  for (uint8_t i = 0; i < size; ++i) {
    out[i] = buffer[i];
  }
  return true;
}

bool write_twi(uint8_t address, uint8_t reg, uint8_t value) {
  uint8_t buffer[2] = {reg, value};
  return transfer(address, buffer, 2, 0) == TwiStatus::kDone;
}

}  // namespace

void start_spi() {
  PORTD |= kSelect;
  DDRD |= kSelect;
  DDRB |= _BV(2) | _BV(3) | _BV(5);  // SS as an output, else the SPI may fall to slave; MOSI, SCK
  set_control();
}

bool MpuBus::read(uint8_t reg, uint8_t* out, uint8_t size) {
  if (!spi_) {
    return read_twi(kMpuAddress, reg, out, size);
  }
  const Selected chip;
  exchange(reg | 0x80);
  for (uint8_t i = 0; i < size; ++i) {
    out[i] = exchange(0);
  }
  return true;
}

bool MpuBus::write(uint8_t reg, uint8_t value) {
  if (!spi_) {
    return write_twi(kMpuAddress, reg, value);
  }
  const Selected chip;
  exchange(reg);
  exchange(value);
  return true;
}

bool MagBus::read(uint8_t address, uint8_t reg, uint8_t* out, uint8_t size) {
  return read_twi(address, reg, out, size);
}

bool MagBus::write(uint8_t address, uint8_t reg, uint8_t value) {
  return write_twi(address, reg, value);
}

}  // namespace arduimu
