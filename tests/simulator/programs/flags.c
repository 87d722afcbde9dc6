// SBI on a flag register clears one flag, STS clears those written; SBI on PIN toggles one bit.
#include "common.h"

int main(void) {
  DDRA = 0xFF;
  PORTA = 0x0F;
  PINA |= _BV(PA7);  // one SBI
  put(PORTA);
  PINA = 0x81;
  put(PORTA);
  OCR1A = 2;
  OCR1B = 3;
  OCR1C = 4;
  TCCR1B = _BV(CS10);
  for (uint8_t i = 0; i < 10; i++) __asm__ __volatile__("nop");
  TCCR1B = 0;
  put(TIFR1);
  TIFR1 |= _BV(OCF1B);  // compiles to SBI: only B may go
  put(TIFR1);
  TIFR1 = _BV(OCF1A);
  put(TIFR1);
  finished = 1;
  for (;;) {
  }
}
