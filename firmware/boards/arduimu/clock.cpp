// Timer 1 stamps the samples; timer 0 wakes the main loop every millisecond.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <util/atomic.h>

#include "boards/arduimu/board.h"

namespace {

volatile uint32_t g_turns;  // of timer 1, 32.768 ms each
volatile uint32_t g_ready_us;
volatile uint8_t g_edges;

}  // namespace

ISR(TIMER1_OVF_vect) {
  ++g_turns;
}

ISR(TIMER0_COMPA_vect) {
  arduimu::g_awake = true;
}

// About 4 us from the edge to the stamp, the time of another interrupt more if one runs.
ISR(INT0_vect) {
  g_ready_us = arduimu::now_us();
  ++g_edges;
  arduimu::g_awake = true;
}

namespace arduimu {

volatile bool g_awake = false;

void start_clock() {
  TCCR1A = 0;
  TCCR1B = _BV(CS11);  // 16 MHz / 8
  TIMSK1 = _BV(TOIE1);
  TCCR0A = _BV(WGM01);
  TCCR0B = _BV(CS01) | _BV(CS00);  // 16 MHz / 64
  OCR0A = 249;
  TIMSK0 = _BV(OCIE0A);
}

uint32_t now_us() {
  uint32_t turns;
  uint16_t ticks;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    ticks = TCNT1;
    turns = g_turns;
    if ((TIFR1 & _BV(TOV1)) != 0 && ticks < 0x8000U) {
      ++turns;  // the overflow waits to be counted
    }
  }
  return (turns << 15) | (ticks >> 1);
}

void start_ready() {
  DDRD &= uint8_t(~kReady);
  EICRA = _BV(ISC01) | _BV(ISC00);  // rising edge
  EIFR = _BV(INTF0);
  EIMSK = _BV(INT0);
}

bool take_ready(uint32_t& at_us, uint8_t& edges) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    at_us = g_ready_us;
    edges = g_edges;
    g_edges = 0;
  }
  return edges != 0;
}

void sleep_until_interrupt() {
  SMCR = _BV(SE);  // idle
  for (;;) {
    cli();
    if (g_awake) {
      break;
    }
    sei();  // takes effect behind the next instruction: no interrupt can slip in between
    sleep_cpu();
  }
  g_awake = false;
  sei();
  SMCR = 0;
}

}  // namespace arduimu
