// Says on PA5 (no timer's pin) that it runs, keeps a counter in .noinit and the cause of the reset.
#include "common.h"

volatile uint8_t cause;
volatile uint16_t kept __attribute__((section(".noinit")));
volatile uint16_t fresh;

int main(void) {
  cause = MCUSR;
  MCUSR = 0;
  wdt_disable();
  kept++;
  fresh++;
  DDRA |= _BV(PA5);
  PORTA |= _BV(PA5);
  DDRK = 0;
  finished = 1;
  if (!(PINK & _BV(PK0))) {
    wdt_enable(WDTO_250MS);
  }
  for (;;) {
    result[0] = PINK;
  }
}
