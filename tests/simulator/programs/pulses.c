// Stamps every change of PORTK and PORTB from the free-running timer 5 (0.5 us).
#include "common.h"

volatile uint16_t stamp[2][64];
volatile uint8_t level[2][64];
volatile uint8_t count[2];

static inline void take(uint8_t bank, uint8_t pins) {
  const uint8_t i = count[bank] & 63;
  stamp[bank][i] = TCNT5;
  level[bank][i] = pins;
  count[bank]++;
}

ISR(PCINT2_vect) {
  take(1, PINK);
}
ISR(PCINT0_vect) {
  take(0, PINB);
}

int main(void) {
  TCCR5B = _BV(CS51);
  PCMSK0 = _BV(PCINT0);
  PCMSK2 = _BV(PCINT16) | _BV(PCINT18);
  PCICR = _BV(PCIE2) | _BV(PCIE0);
  set_sleep_mode(SLEEP_MODE_IDLE);
  sei();
  for (;;) sleep_mode();
}
