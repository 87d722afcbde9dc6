// Timer 1 stamps the samples; timer 0 wakes the main loop every millisecond.
#include <avr/interrupt.h>
#include <avr/io.h>

#include "boards/arduimu/board.h"
#include "boards/avr/awake.h"
#include "boards/avr/interrupts_off.h"
#include "hal/clock.h"
#include "hal/data_ready.h"

namespace {

volatile uint32_t g_turns;  // of timer 1, 32.768 ms each
volatile uint32_t g_ready_turns;
volatile uint16_t g_ready_ticks;
volatile uint8_t g_edges;

// From the edge to the read of the timer: 8 cycles out of sleep, 30 of prologue.
constexpr uint16_t kEntryTicks = 5;

// Turns that belong to a count read with interrupts off: an overflow may wait to be counted.
inline __attribute__((always_inline)) uint32_t turns_at(const uint16_t ticks) {
  const uint32_t turns = g_turns;
  return (TIFR1 & _BV(TOV1)) != 0 && ticks < 0x8000U ? turns + 1 : turns;
}

inline __attribute__((always_inline)) uint32_t us_of(const uint32_t turns, const uint16_t ticks) {
  return (turns << 15) | (ticks >> 1);
}

}  // namespace

// Cycles, entry included, seen at most in flight (tests/chip/imu): 58, 31, 29 and 86.
ISR(TIMER1_OVF_vect) {
  ++g_turns;
}

ISR(TIMER1_COMPA_vect) {
  TIMSK1 = _BV(TOIE1);
  avr::wake();
}

ISR(TIMER0_COMPA_vect) {
  avr::wake();
}

// Late by the time of another interrupt if one runs: 9 us at most, that of TWI.
ISR(INT0_vect) {
  const uint16_t ticks = TCNT1;
  g_ready_turns = turns_at(ticks);
  g_ready_ticks = ticks;
  ++g_edges;
  avr::wake();
}

namespace arduimu {

void start_clock() {
  TCCR1A = 0;
  TCCR1B = _BV(CS11);  // 16 MHz / 8
  TIMSK1 = _BV(TOIE1);
  TCCR0A = _BV(WGM01);
  TCCR0B = _BV(CS01) | _BV(CS00);  // 16 MHz / 64
  OCR0A = 249;
  TIMSK0 = _BV(OCIE0A);
}

}  // namespace arduimu

namespace hal {

uint32_t now_us() {
  uint32_t turns;
  uint16_t ticks;
  {
    const avr::InterruptsOff guard;
    ticks = TCNT1;
    turns = turns_at(ticks);
  }
  return us_of(turns, ticks);
}

void wake_at(const uint32_t at_us) {
  const avr::InterruptsOff guard;
  OCR1A = uint16_t(at_us << 1);
  TIFR1 = _BV(OCF1A);
  TIMSK1 = _BV(TOIE1) | _BV(OCIE1A);
}

void start_data_ready() {
  DDRD &= uint8_t(~arduimu::kReady);
  EICRA = _BV(ISC01) | _BV(ISC00);  // rising edge
  EIFR = _BV(INTF0);
  EIMSK = _BV(INT0);
}

bool take_data_ready(uint32_t& at_us, uint8_t& edges) {
  uint32_t turns;
  uint16_t ticks;
  {
    const avr::InterruptsOff guard;
    turns = g_ready_turns;
    ticks = g_ready_ticks;
    edges = g_edges;
    g_edges = 0;
  }
  at_us = us_of(turns, ticks) - kEntryTicks / 2;
  return edges != 0;
}

}  // namespace hal
