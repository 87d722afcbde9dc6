// UDRE, RXC and TWINT stay requested until they are served: interrupts enabled inside such a
// handler enter it again. TXC does not.
#include "common.h"

volatile uint8_t depth, deepest, entries, nested_txc, kind;

ISR(USART0_UDRE_vect) {
  depth++;
  entries++;
  if (depth > deepest) deepest = depth;
  if (entries < 5) sei();
  __asm__ __volatile__("nop\n nop\n nop");
  cli();
  depth--;
  UCSR0B &= (uint8_t)~_BV(UDRIE0);
}

ISR(USART1_RX_vect) {
  depth++;
  entries++;
  if (depth > deepest) deepest = depth;
  if (entries < 7) sei();
  __asm__ __volatile__("nop\n nop\n nop");
  cli();
  depth--;
  (void)UDR1;
}

ISR(TIMER1_OVF_vect) {
  depth++;
  entries++;
  if (depth > deepest) deepest = depth;
  sei();
  __asm__ __volatile__("nop\n nop\n nop");
  cli();
  depth--;
}

static void begin(void) {
  cli();
  depth = deepest = entries = 0;
}

int main(void) {
  UBRR1 = 25;
  UCSR1B = _BV(RXEN1);
  UCSR0B = _BV(TXEN0);
  begin();
  UCSR0B |= _BV(UDRIE0);
  sei();
  __asm__ __volatile__("nop\n nop");
  cli();
  put(deepest);
  finished = 1;
  while (!(UCSR1A & _BV(RXC1))) {
  }
  begin();
  UCSR1B |= _BV(RXCIE1);
  sei();
  __asm__ __volatile__("nop\n nop");
  cli();
  UCSR1B &= (uint8_t)~_BV(RXCIE1);
  put(deepest);
  begin();
  TCNT1 = 0xFFF0;
  TCCR1B = _BV(CS10);
  TIMSK1 = _BV(TOIE1);
  sei();
  for (uint8_t i = 0; i < 40; i++) __asm__ __volatile__("nop");
  cli();
  put(deepest);
  finished = 2;
  for (;;) {
  }
}
