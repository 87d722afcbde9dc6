// Receiver edges on port K (A8 to A12), stamped from the 2 MHz clock.
#include "hal/pulse_capture.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#include "boards/mega2560/generated/pins.h"
#include "boards/mega2560/interrupts.h"

namespace {

constexpr uint8_t kLines =
    pins::Rc0::kMask | pins::Rc1::kMask | pins::Rc2::kMask | pins::Rc3::kMask | pins::Rc4::kMask;
static_assert(kLines == 0x1F, "the receiver's inputs are the low five bits of one port");

constexpr uint8_t kEdges = 32;  // 3 ms of five simultaneous channels, a power of two
constexpr uint8_t kLate = 0x80;

struct Stamp {
  uint16_t ticks;
  uint8_t levels;  // and kLate
};

Stamp g_stamps[kEdges];
volatile uint8_t g_head;  // written by the interrupt
volatile uint8_t g_tail;  // written by the main loop
volatile uint16_t g_lost;
volatile uint8_t g_gap;  // kLate for the first edge after the bank was masked

}  // namespace

// 60 to 70 cycles for one edge. A second edge while it runs is stamped in the same call, at most
// 40 cycles after it happened. A full buffer masks the bank: a storm of edges cannot starve the
// main loop, which unmasks it in take_edge().
ISR(PCINT2_vect) {
  for (;;) {
    const uint16_t ticks = TCNT5;
    PCIFR = _BV(PCIF2);
    const uint8_t levels = PINK & kLines;
    const uint8_t head = g_head;
    const uint8_t next = (head + 1U) & (kEdges - 1U);
    if (next == g_tail) {
      PCICR &= uint8_t(~_BV(PCIE2));
      ++g_lost;
      return;
    }
    g_stamps[head].ticks = ticks;
    g_stamps[head].levels = levels | g_gap;
    g_gap = 0;
    g_head = next;
    if ((PCIFR & _BV(PCIF2)) == 0) {
      return;
    }
  }
}

namespace hal {

void start_pulse_capture() {
  PCMSK2 = kLines;
  PCIFR = _BV(PCIF2);
  PCICR |= _BV(PCIE2);
}

bool take_edge(Edge* const edge) {
  const uint8_t tail = g_tail;
  if (tail == g_head) {
    if ((PCICR & _BV(PCIE2)) == 0) {
      const mega::InterruptsOff guard;
      g_gap = kLate;  // edges were missed: what is measured across the gap is not a pulse
      PCIFR = _BV(PCIF2);
      PCICR |= _BV(PCIE2);
    }
    return false;
  }
  edge->at_ticks = g_stamps[tail].ticks;
  edge->levels = g_stamps[tail].levels & kLines;
  edge->late = (g_stamps[tail].levels & kLate) != 0;
  g_tail = (tail + 1U) & (kEdges - 1U);
  return true;
}

uint16_t lost_edges() {
  const mega::InterruptsOff guard;
  return g_lost;
}

}  // namespace hal
