// Input capture on ICP4 (PL0) and ICP5 (PL1), timers started in step through GTCCR.
#include "common.h"

volatile uint16_t captured[2][8];
volatile uint8_t count[2];

ISR(TIMER4_CAPT_vect) {
  captured[0][count[0]++ & 7] = ICR4;
}
ISR(TIMER5_CAPT_vect) {
  captured[1][count[1]++ & 7] = ICR5;
}

int main(void) {
  GTCCR = _BV(TSM) | _BV(PSRSYNC);
  TCCR4B = _BV(ICES4) | _BV(CS41);
  TCCR5B = _BV(ICES5) | _BV(CS51);
  TCNT4 = 0;
  for (uint8_t i = 0; i < 40; i++) __asm__ __volatile__("nop");
  TCNT5 = 0;
  TIMSK4 = _BV(ICIE4);
  TIMSK5 = _BV(ICIE5);
  GTCCR = 0;
  sei();
  finished = 1;
  for (;;) {
  }
}
