// Copies receiver channel PK0 to a servo pulse on PE4 and turns the heartbeat PH5 over every 1 ms;
// PA0 low stops the heartbeat high, PA1 low stops it low, PA2 low hangs with interrupts off.
#include "common.h"

volatile uint16_t rise;

ISR(PCINT2_vect) {
  const uint16_t now = TCNT5;
  if (PINK & _BV(PK0))
    rise = now;
  else
    OCR3B = (uint16_t)(now - rise) - 1;
}

int main(void) {
  PORTA = 0xFF;
  DDRH = _BV(PH5);
  DDRE = _BV(PE4);
  TCCR3A = _BV(WGM31);
  TCCR3B = _BV(WGM33) | _BV(WGM32);
  ICR3 = 39999;
  TCCR3A |= _BV(COM3B1);
  TCCR3B |= _BV(CS31);
  TCCR5B = _BV(CS51);
  PCMSK2 = _BV(PCINT16);
  PCICR = _BV(PCIE2);
  sei();
  uint16_t last = TCNT4;
  TCCR4B = _BV(CS41);
  for (;;) {
    const uint16_t now = TCNT4;
    if ((uint16_t)(now - last) < 2000) continue;
    last = now;
    if (!(PINA & _BV(PA2))) {
      cli();
      for (;;) {
      }
    }
    if (!(PINA & _BV(PA0)))
      PORTH |= _BV(PH5);
    else if (!(PINA & _BV(PA1)))
      PORTH &= (uint8_t)~_BV(PH5);
    else
      PINH = _BV(PH5);
  }
}
