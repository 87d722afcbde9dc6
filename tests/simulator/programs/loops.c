// A main loop that sleeps once a turn: 100 us of work every 1 ms, every tenth turn 300 us.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <util/delay.h>

volatile uint8_t awake;

ISR(TIMER0_COMPA_vect) {
  awake = 1;
}

int main(void) {
  TCCR0A = _BV(WGM01);
  TCCR0B = _BV(CS01) | _BV(CS00);  // 16 MHz / 64
  OCR0A = 249;
  TIMSK0 = _BV(OCIE0A);
  sei();
  for (uint8_t turn = 0;; turn = turn == 9 ? 0 : (uint8_t)(turn + 1)) {
    _delay_us(100);
    if (turn == 9) _delay_us(200);
    SMCR = _BV(SE);
    while (!awake) sleep_cpu();
    awake = 0;
    SMCR = 0;
  }
}
