// Writes two bytes, measures how long EEPE stays set, reads them back.
#include <avr/eeprom.h>

#include "common.h"

volatile uint16_t busy_ticks;
volatile uint8_t back[2], without_arming;

int main(void) {
  TCCR1B = _BV(CS11);  // 0.5 us
  EEAR = 10;
  EEDR = 0xA5;
  EECR |= _BV(EEMPE);
  EECR |= _BV(EEPE);
  const uint16_t from = TCNT1;
  while (EECR & _BV(EEPE)) {
  }
  busy_ticks = TCNT1 - from;
  eeprom_write_byte((uint8_t*)11, 0x3C);
  eeprom_busy_wait();
  back[0] = eeprom_read_byte((uint8_t*)10);
  back[1] = eeprom_read_byte((uint8_t*)11);
  EEAR = 10;
  EEDR = 0;
  EECR |= _BV(EEPE);
  without_arming = EECR & _BV(EEPE);
  finished = 1;
  for (;;) {
  }
}
