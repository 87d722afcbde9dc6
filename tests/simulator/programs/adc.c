// Converts all channels polled, changes the channel in the middle of a conversion, measures times
// with timer 1 in cycles, clears ADIF by writing one.
#include "common.h"

volatile uint16_t code[18];
volatile uint16_t unsettled;  // the reference, just chosen
volatile uint16_t first_cycles, next_cycles;
volatile uint16_t latched, after_write, still_set;
volatile uint16_t by_interrupt;
volatile uint8_t interrupts;

ISR(ADC_vect) {
  by_interrupt = ADC;
  interrupts++;
}

static void channel(uint8_t mux) {
  ADMUX = _BV(REFS0) | (mux & 0x1F);
  ADCSRB = (mux & 0x20) ? _BV(MUX5) : 0;
}

static uint16_t convert(void) {
  ADCSRA |= _BV(ADSC);
  while (ADCSRA & _BV(ADSC)) {
  }
  return ADC;
}

int main(void) {
  TCCR1B = _BV(CS10);
  ADCSRA = _BV(ADEN) | 7;
  channel(0);
  uint16_t from = TCNT1;
  code[0] = convert();
  first_cycles = TCNT1 - from;
  from = TCNT1;
  convert();
  next_cycles = TCNT1 - from;
  for (uint8_t i = 0; i < 16; i++) {
    channel(i < 8 ? i : i - 8 + 0x20);
    code[i] = convert();
  }
  channel(0x1E);
  unsettled = convert();
  code[16] = convert();
  channel(0x1F);
  code[17] = convert();

  channel(1);
  ADCSRA |= _BV(ADSC);
  for (uint8_t i = 0; i < 100; i++) __asm__ __volatile__("nop");
  channel(2);  // too late for this conversion
  while (ADCSRA & _BV(ADSC)) {
  }
  channel(3);  // and so is this for the result
  latched = ADC;

  still_set = ADCSRA & _BV(ADIF);
  ADCSRA |= _BV(ADIF);
  after_write = ADCSRA & _BV(ADIF);

  channel(0x25);
  ADCSRA |= _BV(ADIE);
  sei();
  ADCSRA |= _BV(ADSC);
  while (interrupts == 0) {
  }
  finished = 1;
  ADMUX = _BV(REFS0) | 4;
  ADCSRB = 0;
  ADCSRA |= _BV(ADATE) | _BV(ADSC);  // free running: 104 us each
  for (;;) {
  }
}
