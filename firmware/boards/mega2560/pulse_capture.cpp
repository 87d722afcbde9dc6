// Receiver edges on port K (A8 to A12), stamped from the 2 MHz clock.
#include "hal/pulse_capture.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#include "boards/avr/interrupts_off.h"
#include "boards/mega2560/board.h"
#include "boards/mega2560/generated/pins.h"
#include "core/storm_guard.h"

namespace {

constexpr uint8_t kLines =
    pins::Rc0::kMask | pins::Rc1::kMask | pins::Rc2::kMask | pins::Rc3::kMask | pins::Rc4::kMask;
static_assert(kLines == 0x1F, "the receiver's inputs are the low five bits of one port");

constexpr uint8_t kEdges = 24;  // two frames of five channels
constexpr uint8_t kLate = 0x80;

struct Stamp {
  uint16_t ticks;
  uint8_t levels;  // and kLate
};
static_assert(sizeof(Stamp) == 3, "the interrupt counts in bytes");
constexpr uint8_t kStampBytes = kEdges * sizeof(Stamp);

}  // namespace

#define FOR_THE_INTERRUPT __attribute__((used, externally_visible))

// Shared with the assembly below, hence C names, kept by the linker; volatile because only it
// writes them. Positions are byte offsets: the interrupt has no time to multiply.
extern "C" {

volatile Stamp capture_stamps[kEdges] FOR_THE_INTERRUPT;
volatile uint8_t capture_head FOR_THE_INTERRUPT;  // written by the interrupt
volatile uint8_t capture_tail FOR_THE_INTERRUPT;  // written by the main loop
volatile uint16_t capture_lost FOR_THE_INTERRUPT;
volatile uint8_t capture_gap FOR_THE_INTERRUPT;    // kLate: some edges were missed
core::StormGuard capture_guard FOR_THE_INTERRUPT;  // its first byte counts edges

}  // extern "C"

static_assert(sizeof(core::StormGuard) == 2, "the interrupt counts in its first byte");

// In assembly, because the compiler saves sixteen registers before it looks at the timer: 45
// cycles, which an edge caught in the loop does not wait, so that pulses came out up to 5 us wrong.
// Here the stamp is taken 15 cycles after the edge, in the loop 0 to 45 after it. The flag is
// cleared before the levels are read, or an edge between would be lost, and these stand next to the
// stamp: an edge between gets a stamp up to 8 cycles early. 82 cycles for one edge, 55 for each
// further one.
//   StormGuard::edge() and the ring's put are written out; kMaxEdgesPerMs is %[storm] - 1.
ISR(PCINT2_vect, ISR_NAKED) {
  __asm__ __volatile__(
      "push r24 \n\t"
      "in r24, __SREG__ \n\t"
      "push r24 \n\t"
      "push r25 \n\t"
      "lds r24, %[timer] \n\t"
      "lds r25, %[timer]+1 \n\t"
      "push r23 \n\t"
      "sbi %[flags], %[flag] \n\t"
      "lds r23, %[pins] \n\t"
      "push r30 \n\t"
      "push r31 \n\t"
      "1: lds r30, capture_head \n\t"
      "ldi r31, 0 \n\t"
      "subi r30, lo8(-(capture_stamps)) \n\t"
      "sbci r31, hi8(-(capture_stamps)) \n\t"
      "st Z, r24 \n\t"
      "std Z+1, r25 \n\t"
      "andi r23, %[lines] \n\t"
      "lds r25, capture_gap \n\t"
      "or r23, r25 \n\t"
      "std Z+2, r23 \n\t"
      "lds r24, capture_head \n\t"
      "subi r24, -3 \n\t"
      "cpi r24, %[bytes] \n\t"
      "brne 2f \n\t"
      "ldi r24, 0 \n\t"
      "2: lds r25, capture_tail \n\t"
      "cp r24, r25 \n\t"
      "breq 5f \n\t"
      "sts capture_head, r24 \n\t"
      "ldi r24, 0 \n\t"
      "sts capture_gap, r24 \n\t"
      "3: lds r24, capture_guard \n\t"
      "inc r24 \n\t"
      "sts capture_guard, r24 \n\t"
      "cpi r24, %[storm] \n\t"
      "brsh 6f \n\t"
      "sbis %[flags], %[flag] \n\t"
      "rjmp 4f \n\t"
      "lds r24, %[timer] \n\t"
      "lds r25, %[timer]+1 \n\t"
      "sbi %[flags], %[flag] \n\t"
      "lds r23, %[pins] \n\t"
      "rjmp 1b \n\t"
      "4: pop r31 \n\t"
      "pop r30 \n\t"
      "pop r23 \n\t"
      "pop r25 \n\t"
      "pop r24 \n\t"
      "out __SREG__, r24 \n\t"
      "pop r24 \n\t"
      "reti \n\t"
      // full: the edge is lost, and what is measured across the gap is not a pulse
      "5: lds r24, capture_lost \n\t"
      "lds r25, capture_lost+1 \n\t"
      "adiw r24, 1 \n\t"
      "sts capture_lost, r24 \n\t"
      "sts capture_lost+1, r25 \n\t"
      "ldi r24, %[late] \n\t"
      "sts capture_gap, r24 \n\t"
      "rjmp 3b \n\t"
      // storm: mask the bank; tick_pulse_capture() lets it back in
      "6: lds r24, %[control] \n\t"
      "andi r24, %[masked] \n\t"
      "sts %[control], r24 \n\t"
      "ldi r24, %[late] \n\t"
      "sts capture_gap, r24 \n\t"
      "rjmp 4b \n\t" ::[timer] "n"(_SFR_MEM_ADDR(TCNT5)),
      [flags] "I"(_SFR_IO_ADDR(PCIFR)),
      [flag] "I"(PCIF2),
      [pins] "n"(_SFR_MEM_ADDR(PINK)),
      [control] "n"(_SFR_MEM_ADDR(PCICR)),
      [masked] "n"(0xFF & ~_BV(PCIE2)),
      [lines] "n"(kLines),
      [late] "n"(kLate),
      [bytes] "n"(kStampBytes),
      [storm] "n"(core::StormGuard::kMaxEdgesPerMs + 1));
}

namespace mega {

void tick_pulse_capture() {
  // Off for 10 cycles, 30 when the bank comes back: an edge between the look at the count and its
  // reset would mask the bank, and nothing would ever let it back in.
  const avr::InterruptsOff guard;
  if (capture_guard.tick()) {
    PCIFR = _BV(PCIF2);
    PCICR |= _BV(PCIE2);
  }
}

}  // namespace mega

namespace hal {

void start_pulse_capture() {
  PCMSK2 = kLines;
  PCIFR = _BV(PCIF2);
  PCICR |= _BV(PCIE2);
}

bool edge_waits() {
  return capture_tail != capture_head;
}

bool take_edge(Edge* const edge) {
  const uint8_t tail = capture_tail;
  if (tail == capture_head) {
    return false;
  }
  // By its offset: its number would be a division.
  const volatile Stamp& stamp = *reinterpret_cast<const volatile Stamp*>(
      reinterpret_cast<const volatile uint8_t*>(capture_stamps) + tail);
  edge->at_ticks = stamp.ticks;
  edge->levels = stamp.levels & kLines;
  edge->late = (stamp.levels & kLate) != 0;
  const uint8_t next = uint8_t(tail + sizeof(Stamp));
  capture_tail = next == kStampBytes ? 0 : next;
  return true;
}

uint8_t edge_storm() {
  return capture_guard.masked() ? core::StormGuard::kMaxEdgesPerMs + 1U : 0;
}

uint16_t lost_edges() {
  const avr::InterruptsOff guard;
  return capture_lost;
}

}  // namespace hal
