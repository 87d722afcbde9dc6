// BENCH ONLY: no flight code yet. Servo and relay pins stay inputs, as reset leaves them.
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <stdint.h>

namespace {

const char kBootLine[] PROGMEM = "BENCH ONLY\r\n";

void put(uint8_t letter) {
  while ((UCSR0A & _BV(UDRE0)) == 0) {
  }
  UDR0 = letter;
}

}  // namespace

int main() {
  UBRR0 = 16;  // 115 200 baud at U2X, 2.1 % fast
  UCSR0A = _BV(U2X0);
  UCSR0B = _BV(TXEN0);
  for (const char* at = kBootLine; pgm_read_byte(at) != 0; ++at) {
    put(pgm_read_byte(at));
  }
  for (;;) {
  }
}
