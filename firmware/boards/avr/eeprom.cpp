// EEPROM, a byte at a time in the background.
#include "hal/eeprom.h"

#include <avr/io.h>
#include <util/delay.h>

#include "boards/avr/interrupts_off.h"

namespace {

constexpr uint16_t kPolls = 500;  // of 10 us: 5 ms, for the 3.4 ms of a write

}  // namespace

namespace hal {

uint8_t read_eeprom(const uint16_t address) {
  for (uint16_t left = kPolls; !eeprom_ready(); --left) {
    if (left == 0) {
      return 0xFF;
    }
    _delay_us(10);
  }
  EEAR = address;
  EECR |= _BV(EERE);
  return EEDR;
}

void read_eeprom_bytes(uint16_t address, void* const to, const uint8_t size) {
  uint8_t* bytes = static_cast<uint8_t*>(to);
  (void)read_eeprom(address);  // waits
  const uint8_t none = eeprom_ready() ? 0x00 : 0xFF;
  for (uint8_t left = size; left != 0; --left) {
    EEAR = address++;
    EECR |= _BV(EERE);
    *bytes++ = uint8_t(EEDR | none);
  }
}

bool eeprom_ready() {
  return (EECR & _BV(EEPE)) == 0;
}

void write_eeprom(const uint16_t address, const uint8_t value) {
  if (read_eeprom(address) == value) {
    return;
  }
  EEAR = address;
  EEDR = value;
  const avr::InterruptsOff guard;  // EEPE must follow EEMPE within four cycles
  EECR = _BV(EEMPE);
  EECR = _BV(EEMPE) | _BV(EEPE);
}

}  // namespace hal
