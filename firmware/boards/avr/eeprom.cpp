// EEPROM, a byte at a time in the background.
#include "hal/eeprom.h"

#include <avr/io.h>

#include "boards/avr/interrupts_off.h"

namespace hal {

uint8_t read_eeprom(const uint16_t address) {
  while (!eeprom_ready()) {  // 3.4 ms, and only when a write was just begun
  }
  EEAR = address;
  EECR |= _BV(EERE);
  return EEDR;
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
