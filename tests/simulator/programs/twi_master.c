// For the ATmega328P: a TWI master that polls, writes a register, reads two back behind a repeated
// START, and keeps the status of every step; then it sleeps, woken by an empty timer interrupt.
#include <avr/sleep.h>
#include <util/twi.h>

#include "common.h"

volatile uint8_t address = 0x1E;
volatile uint8_t status_seen[16];
volatile uint8_t steps;
volatile uint8_t read_back[2];
volatile uint8_t again;

EMPTY_INTERRUPT(TIMER0_COMPA_vect);

static uint8_t step(uint8_t control) {
  TWCR = _BV(TWINT) | _BV(TWEN) | control;
  for (uint16_t i = 0; i < 4000 && !(TWCR & _BV(TWINT)); i++) {
  }
  const uint8_t status = TWCR & _BV(TWINT) ? TW_STATUS : 0xFF;
  status_seen[steps++ & 15] = status;
  return status;
}

static void exchange(void) {
  steps = 0;
  step(_BV(TWSTA));
  TWDR = (uint8_t)(address << 1);
  if (step(0) == TW_MT_SLA_ACK) {
    TWDR = 3;
    step(0);
    step(_BV(TWSTA));
    TWDR = (uint8_t)(address << 1 | 1);
    step(0);
    step(_BV(TWEA));
    read_back[0] = TWDR;
    step(0);
    read_back[1] = TWDR;
  }
  TWCR = _BV(TWINT) | _BV(TWEN) | _BV(TWSTO);
  for (uint16_t i = 0; i < 4000 && (TWCR & _BV(TWSTO)); i++) {
  }
}

int main(void) {
  TWBR = 12;  // 400 kHz
  exchange();
  finished = 1;
  OCR0A = 249;
  TCCR0A = _BV(WGM01);
  TCCR0B = _BV(CS01) | _BV(CS00);
  TIMSK0 = _BV(OCIE0A);
  SMCR = _BV(SE);
  sei();
  for (;;) {
    sleep_cpu();
    if (again) {
      again = 0;
      exchange();
      finished++;
    }
  }
}
