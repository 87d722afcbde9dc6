// Servo pulses on timer 3 (mode 14) and timer 1, compare registers rewritten at any time from a
// list of four widths; then TOP is changed while the timer runs.
#include "common.h"

static const uint16_t kWidths[4] = {2000, 2500, 3000, 3999};
volatile uint16_t read_back, icr_before;
volatile uint8_t change_top;

int main(void) {
  DDRE = _BV(PE3) | _BV(PE4) | _BV(PE5);
  DDRB = _BV(PB5);
  ICR3 = 9999;  // ignored: the mode does not yet use it
  icr_before = ICR3;
  TCCR3A = _BV(COM3A1) | _BV(COM3B1) | _BV(COM3C1) | _BV(WGM31);
  TCCR3B = _BV(WGM33) | _BV(WGM32);
  ICR3 = 39999;
  OCR3A = 2999;
  OCR3B = 2000;
  OCR3C = 3999;
  TCCR3B |= _BV(CS31);
  read_back = OCR3B;
  uint16_t wait = 1;
  uint8_t i = 0;
  for (;;) {
    wait = wait * 25173u + 13849u;
    for (uint16_t n = wait & 0x3FFF; n; n--) __asm__ __volatile__("");
    OCR3B = kWidths[i++ & 3];
    PORTE ^= _BV(PE2);  // another bit of the port must not disturb the pulses
    if (change_top) {
      change_top = 0;
      ICR3 = 19999;
      finished = 1;
    }
  }
}
