// Timer 5 runs free at 2 MHz: every stamp of the instrument comes from it.
#include "hal/clock.h"

#include <avr/io.h>

#include "boards/mega2560/board.h"
#include "boards/mega2560/interrupts.h"

namespace {

// Counts turns of the timer, 32.768 ms each; 17 bits of it reach now_us().
volatile uint32_t g_turns;

}  // namespace

ISR(TIMER5_OVF_vect) {
  ++g_turns;
}  // 36 cycles

// 1 kHz, only to end the sleep of the main loop.
EMPTY_INTERRUPT(TIMER2_COMPA_vect)

namespace mega {

void start_clock() {
  TCCR5A = 0;
  TCCR5B = _BV(CS51);  // 16 MHz / 8
  TIMSK5 = _BV(TOIE5);
  TCCR2A = _BV(WGM21);
  TCCR2B = _BV(CS22);  // 16 MHz / 64
  OCR2A = 249;
  TIMSK2 = _BV(OCIE2A);
}

}  // namespace mega

namespace hal {

uint32_t now_us() {
  uint16_t ticks;
  uint32_t turns;
  {
    const mega::InterruptsOff guard;  // the timer's bytes share TEMP with the receiver's interrupt
    ticks = TCNT5;
    turns = g_turns;
    if ((TIFR5 & _BV(TOV5)) != 0 && ticks < 0x8000U) {
      ++turns;  // the overflow waits to be counted
    }
  }
  return (turns << 15) | (ticks >> 1);
}

uint16_t now_ticks() {
  const mega::InterruptsOff guard;
  return TCNT5;
}

}  // namespace hal
