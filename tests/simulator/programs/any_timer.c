// Sets timer 4 and timer 2 up as it is told, again and again: fast PWM or CTC with toggled output.
#include "common.h"

volatile uint8_t go, clock4, clock2, ocr2, toggle;
volatile uint16_t top, ocr4;

int main(void) {
  DDRH = _BV(PH3) | _BV(PH6);
  for (;;) {
    while (!go) {
    }
    go = 0;
    TCCR4B = 0;
    TCCR2B = 0;
    TCNT4 = 0;
    TCNT2 = 0;
    if (toggle) {  // CTC, TOP in ICR4 and OCR2A
      TCCR4A = _BV(COM4A0);
      TCCR4B = _BV(WGM43) | _BV(WGM42);
      ICR4 = top;
      OCR4A = ocr4;
      TCCR2A = _BV(COM2B0) | _BV(WGM21);
      OCR2A = ocr2;
      OCR2B = ocr2 / 2;
    } else {
      TCCR4A = _BV(COM4A1) | _BV(WGM41);
      TCCR4B = _BV(WGM43) | _BV(WGM42);
      ICR4 = top;
      OCR4A = ocr4;
      TCCR2A = _BV(COM2B1) | _BV(WGM21) | _BV(WGM20);
      OCR2B = ocr2;
    }
    TCCR4B |= clock4;
    TCCR2B = clock2;
    finished++;
  }
}
