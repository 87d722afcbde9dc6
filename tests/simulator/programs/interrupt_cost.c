// Takes INT0 by a software toggle of its own pin, from a busy loop and out of idle sleep, and lets
// INT0, INT1 and PCINT0 become pending together.
#include "common.h"

volatile uint8_t order[8];
volatile uint8_t order_count;

ISR(INT0_vect) {
  order[order_count++] = 1;
}
ISR(INT1_vect) {
  order[order_count++] = 2;
}
ISR(PCINT0_vect) {
  order[order_count++] = 9;
}
ISR(INT2_vect) {
  result[0]++;
}

int main(void) {
  DDRD = 0;
  EICRA = _BV(ISC01) | _BV(ISC00) | _BV(ISC11) | _BV(ISC10) | _BV(ISC21) | _BV(ISC20);
  PCMSK0 = _BV(PCINT0);
  EIFR = 0xFF;
  // three requests while interrupts are off
  DDRD = _BV(PD0) | _BV(PD1);
  DDRB = _BV(PB0);
  EIMSK = _BV(INT0) | _BV(INT1);
  PCICR = _BV(PCIE0);
  PORTB = _BV(PB0);
  PORTD = _BV(PD1);
  PORTD = _BV(PD1) | _BV(PD0);
  // the instruction after sei runs first: here it turns interrupts off again
  sei();
  cli();
  result[1] = order_count;
  sei();
  // each service lets one instruction of this program run: three, and the one after sei
  __asm__ __volatile__("nop\n nop\n nop\n nop\n");
  cli();
  EIMSK = _BV(INT2);
  PCICR = 0;
  set_sleep_mode(SLEEP_MODE_IDLE);
  finished = 1;
  sei();
  for (;;) {
    if (PINA & _BV(PA0)) {
      sleep_enable();
      sleep_cpu();
    }
  }
}
