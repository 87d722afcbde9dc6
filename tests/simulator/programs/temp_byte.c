// Main program and an interrupt read the same 16-bit timer; the interrupt also reads another one.
// The high byte goes through one TEMP per timer.
#include "common.h"

volatile uint16_t torn_same, torn_other, reads;
volatile uint8_t use_other;
volatile uint16_t sink;

ISR(TIMER0_COMPA_vect) {
  OCR0A += 83;
  sink = use_other ? TCNT4 : TCNT1;
}

int main(void) {
  TCCR1B = _BV(CS10);
  TCCR4B = _BV(CS10);
  TCNT4 = 0x8000;
  TCCR0B = _BV(CS00);
  TIMSK0 = _BV(OCIE0A);
  sei();
  for (;;) {
    const uint16_t from = TCNT1;
    const uint16_t to = TCNT1;
    if ((uint16_t)(to - from) > 250) {
      if (use_other)
        torn_other++;
      else
        torn_same++;
    }
    reads++;
  }
}
