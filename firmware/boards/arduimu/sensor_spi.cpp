// SPI at 1 MHz, mode 3: all registers of the MPU-6000 allow that (PS-MPU-6000A, section 6.5).
#include <avr/io.h>

#include "boards/arduimu/board.h"
#include "boards/avr/spi.h"
#include "hal/sensor_spi.h"

namespace {

using arduimu::kSelect;

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

}  // namespace

namespace hal {

void start_sensor_spi() {
  PORTD |= kSelect;
  DDRD |= kSelect;
  DDRB |= _BV(2) | _BV(3) | _BV(5);  // SS as an output, else the SPI may fall to slave; MOSI, SCK
  set_control();
}

void read_sensor(const uint8_t reg, uint8_t* const out, const uint8_t size) {
  const Selected chip;
  exchange(reg | 0x80);
  for (uint8_t i = 0; i < size; ++i) {
    out[i] = exchange(0);
  }
}

void write_sensor(const uint8_t reg, const uint8_t value) {
  const Selected chip;
  exchange(reg);
  exchange(value);
}

}  // namespace hal
