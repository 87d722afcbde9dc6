// Time of one byte at several clocks in cycles, write collision, mode fault by a low SS input.
#include "common.h"

volatile uint16_t byte_cycles[4];
volatile uint8_t collision, after_clear, read_back, mode_fault, interrupts;

ISR(SPI_STC_vect) {
  interrupts++;
}

static uint16_t measure(void) {
  const uint16_t from = TCNT1;
  SPDR = 0x5A;
  while (!(SPSR & _BV(SPIF))) {
  }
  const uint16_t to = TCNT1;
  read_back = SPDR;
  return to - from;
}

int main(void) {
  TCCR1B = _BV(CS10);
  DDRB = _BV(PB0) | _BV(PB1) | _BV(PB2);
  PORTB = _BV(PB0);
  SPCR = _BV(SPE) | _BV(MSTR);
  SPSR = _BV(SPI2X);
  byte_cycles[0] = measure();
  SPSR = 0;
  byte_cycles[1] = measure();
  SPCR = _BV(SPE) | _BV(MSTR) | _BV(SPR0);
  byte_cycles[2] = measure();
  SPCR = _BV(SPE) | _BV(MSTR) | _BV(SPR1) | _BV(SPR0);
  byte_cycles[3] = measure();

  SPDR = 1;
  SPDR = 2;
  collision = SPSR & _BV(WCOL);
  while (!(SPSR & _BV(SPIF))) {
  }
  (void)SPDR;
  after_clear = SPSR;

  SPCR |= _BV(SPIE);
  sei();
  SPDR = 3;
  while (interrupts == 0) {
  }
  finished = 1;
  while (!(PINA & _BV(PA0))) {
  }
  DDRB &= (uint8_t)~_BV(PB0);  // SS is an input now, and low
  for (uint8_t i = 0; i < 10; i++) __asm__ __volatile__("nop");
  mode_fault = !(SPCR & _BV(MSTR));
  finished = 2;
  for (;;) {
  }
}
