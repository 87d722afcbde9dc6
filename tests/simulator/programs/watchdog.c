// Interrupt and reset mode: the first time-out interrupts and clears WDIE, the second resets. In
// interrupt mode alone it goes on interrupting.
#include "common.h"

volatile uint8_t interrupts __attribute__((section(".noinit")));
volatile uint8_t wdie_in_handler __attribute__((section(".noinit")));
volatile uint8_t cause, wdtcsr_at_start;

ISR(WDT_vect) {
  interrupts++;
  wdie_in_handler = WDTCSR & _BV(WDIE);
}

int main(void) {
  cause = MCUSR;
  wdtcsr_at_start = WDTCSR;
  if (cause & _BV(WDRF)) {
    MCUSR = 0;
    wdt_disable();
    finished = 2;
    for (;;) {
    }
  }
  MCUSR = 0;
  interrupts = 0;
  const uint8_t both = PINA & _BV(PA0) ? _BV(WDE) : 0;
  cli();
  WDTCSR = _BV(WDCE) | _BV(WDE);
  WDTCSR = _BV(WDIE) | both | _BV(WDP0);  // 32 ms
  sei();
  for (;;) {
  }
}
