// Smaller rules of the datasheet: the converter's result is locked between ADCL and ADCH, a timer
// starts conversions, INT in level mode goes on while the pin is low, turning the receiver off
// empties its buffer, WDRF keeps WDE set, SPM outside the boot section does nothing.
#include <avr/boot.h>

#include "common.h"

volatile uint8_t adcl, adch;
volatile uint8_t level_entries, after_flush;
volatile uint8_t wde_with_flag, wde_without;
volatile uint16_t triggered;
volatile uint8_t go;

ISR(INT0_vect) {
  level_entries++;
}
ISR(ADC_vect) {
  triggered++;
}

static void wait_for(uint8_t step) {
  while (go != step) {
  }
}

int main(void) {
  if (MCUSR & _BV(WDRF)) {
    cli();
    wdt_reset();
    WDTCSR = _BV(WDCE) | _BV(WDE);
    WDTCSR = 0;
    wde_with_flag = WDTCSR & _BV(WDE);
    MCUSR = 0;
    wdt_disable();
    wde_without = WDTCSR & _BV(WDE);
    finished = 9;
    for (;;) {
    }
  }
  ADMUX = _BV(REFS0);
  ADCSRA = _BV(ADEN) | _BV(ADSC) | 7;
  while (ADCSRA & _BV(ADSC)) {
  }
  adcl = ADCL;
  finished = 1;
  wait_for(1);
  ADCSRA |= _BV(ADSC);
  while (ADCSRA & _BV(ADSC)) {
  }
  adch = ADCH;

  TCCR0A = _BV(WGM01);
  OCR0A = 249;
  ADCSRB = _BV(ADTS1) | _BV(ADTS0);
  ADCSRA = _BV(ADEN) | _BV(ADATE) | _BV(ADIE) | 7;
  sei();
  TCCR0B = _BV(CS01) | _BV(CS00);  // 1 kHz
  for (uint16_t n = 0; n < 1010;) {
    if (TIFR0 & _BV(OCF0A)) {
      TIFR0 = _BV(OCF0A);
      n++;
    }
    if (n == 1000) break;
  }
  ADCSRA = 0;
  finished = 2;

  wait_for(2);
  EICRA = 0;
  EIMSK = _BV(INT0);
  wait_for(3);
  EIMSK = 0;

  UBRR1 = 25;
  UCSR1B = _BV(RXEN1);
  finished = 3;
  wait_for(4);
  UCSR1B = 0;
  UCSR1B = _BV(RXEN1);
  after_flush = UCSR1A & _BV(RXC1);

  cli();
  boot_page_erase(0x10000UL);
  finished = 4;
  wait_for(5);
  wdt_enable(WDTO_15MS);
  for (;;) {
  }
}
