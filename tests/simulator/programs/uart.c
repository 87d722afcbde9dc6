// Sends bytes back to back on port 0 and then, port 1, receives nothing for a while and reads late.
#include "common.h"

volatile uint8_t got[8];
volatile uint8_t flags[8];
volatile uint8_t got_count;
volatile uint8_t go;
volatile uint16_t udre_cycles, txc_cycles;

int main(void) {
  TCCR1B = _BV(CS11);
  UCSR0A = _BV(U2X0);
  UBRR0 = 16;  // 117647 baud
  UCSR0B = _BV(TXEN0);
  UBRR1 = 25;  // 38461 baud
  UCSR1B = _BV(RXEN1);
  const uint16_t from = TCNT1;
  UDR0 = 0x55;
  UDR0 = 0xAA;
  while (!(UCSR0A & _BV(UDRE0))) {
  }
  udre_cycles = (TCNT1 - from) * 8;
  while (!(UCSR0A & _BV(TXC0))) {
  }
  txc_cycles = (TCNT1 - from) * 8;
  finished = 1;
  for (;;) {
    while (!go) {
    }
    go = 0;
    while (UCSR1A & _BV(RXC1)) {
      flags[got_count & 7] = UCSR1A & (_BV(DOR1) | _BV(FE1));
      got[got_count & 7] = UDR1;
      got_count++;
    }
  }
}
