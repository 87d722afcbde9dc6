// Timer 5 runs free at 2 MHz: every stamp of the instrument comes from it.
#include "hal/clock.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#include "boards/avr/awake.h"
#include "boards/mega2560/board.h"

// Counts turns of the timer, 32.768 ms each; 17 bits of it reach now_us(). Shared with the assembly
// below, hence a C name, kept by the linker.
extern "C" {
struct Turns {
  uint16_t low;
  uint8_t high;
};
volatile Turns clock_turns __attribute__((used, externally_visible));
}

namespace {

struct Now {
  uint32_t ticks;
  uint8_t odd;  // bit 32 of the ticks
};

// In assembly: the main loop asks 5000 times a second. Interrupts are off for 14 cycles, as the
// timer's bytes share TEMP with the receiver's interrupt.
inline __attribute__((always_inline)) Now now() {
  Now at;
  uint8_t flags;
  __asm__ __volatile__(
      "in __tmp_reg__, __SREG__ \n\t"
      "cli \n\t"
      "lds %A[ticks], %[timer] \n\t"
      "lds %B[ticks], %[timer]+1 \n\t"
      "in %[flags], %[timer_flags] \n\t"
      "lds %C[ticks], clock_turns \n\t"
      "lds %D[ticks], clock_turns+1 \n\t"
      "lds %[odd], clock_turns+2 \n\t"
      "out __SREG__, __tmp_reg__ \n\t"
      "sbrs %[flags], %[overflow] \n\t"
      "rjmp 1f \n\t"
      "sbrc %B[ticks], 7 \n\t"  // it came behind the look at the timer
      "rjmp 1f \n\t"
      "subi %C[ticks], 0xFF \n\t"  // not counted yet
      "sbci %D[ticks], 0xFF \n\t"
      "sbci %[odd], 0xFF \n\t"
      "1: \n\t"
      : [ticks] "=&d"(at.ticks), [odd] "=&d"(at.odd), [flags] "=&r"(flags)
      : [timer] "n"(_SFR_MEM_ADDR(TCNT5)),
        [timer_flags] "I"(_SFR_IO_ADDR(TIFR5)),
        [overflow] "I"(TOV5)
      : "memory");
  return at;
}

}  // namespace

// In assembly: 30 cycles instead of 58, 5 more per carry. No interrupt reads the turns, and the
// next comes 32 ms later: others may nest at once.
ISR(TIMER5_OVF_vect, ISR_NAKED) {
  __asm__ __volatile__(
      "sei \n\t"
      "push r24 \n\t"
      "in r24, __SREG__ \n\t"
      "push r24 \n\t"
      "lds r24, clock_turns \n\t"
      "inc r24 \n\t"
      "sts clock_turns, r24 \n\t"
      "brne 1f \n\t"
      "lds r24, clock_turns+1 \n\t"
      "inc r24 \n\t"
      "sts clock_turns+1, r24 \n\t"
      "brne 1f \n\t"
      "lds r24, clock_turns+2 \n\t"
      "inc r24 \n\t"
      "sts clock_turns+2, r24 \n\t"
      "1: pop r24 \n\t"
      "out __SREG__, r24 \n\t"
      "pop r24 \n\t"
      "reti \n\t");
}

// Every second time, 1 kHz: ends the sleep of the main loop, and the rest of a receiver bank that
// stormed.
extern "C" void __vector_millisecond(void) __attribute__((signal, used, externally_visible));
void __vector_millisecond(void) {
  avr::wake();
  mega::tick_pulse_capture();
}

// 2 kHz: looks at the stack. One that runs away goes through all of RAM in 0.66 ms and then writes
// return addresses into the I/O registers: on the way it may toggle the heartbeat for ever, or
// drive receiver lines. So it is stopped before it gets there. Interrupts go on behind the look,
// which an interrupt that enters itself without end could else put off: an edge of the receiver
// waits 19 cycles at most.
ISR(TIMER2_COMPA_vect, ISR_NAKED) {
  __asm__ __volatile__(
      "push r24 \n\t"
      "in r24, __SREG__ \n\t"
      "push r24 \n\t"
      "in r24, __SP_H__ \n\t"
      "cpi r24, hi8(_end + 255) \n\t"
      "brlo 3f \n\t"
      "sei \n\t"
      "sbis %[flags], 0 \n\t"
      "rjmp 1f \n\t"
      "cbi %[flags], 0 \n\t"
      "pop r24 \n\t"
      "out __SREG__, r24 \n\t"
      "pop r24 \n\t"
      "sei \n\t"
      "jmp __vector_millisecond \n\t"
      "1: sbi %[flags], 0 \n\t"
      "pop r24 \n\t"
      "out __SREG__, r24 \n\t"
      "pop r24 \n\t"
      "reti \n\t"
      "3: jmp mega_stack_gone \n\t" ::[flags] "I"(_SFR_IO_ADDR(GPIOR0)));
}

namespace mega {

void start_clock() {
  TCCR5A = 0;
  TCCR5B = _BV(CS51);  // 16 MHz / 8
  TIMSK5 = _BV(TOIE5);
  TCCR2A = _BV(WGM21);
  TCCR2B = _BV(CS22);  // 16 MHz / 64
  OCR2A = 124;
  TIMSK2 = _BV(OCIE2A);
}

}  // namespace mega

namespace hal {

uint32_t now_us() {
  Now at = now();
  __asm__(
      "lsr %[odd] \n\t"
      "ror %D[ticks] \n\t"
      "ror %C[ticks] \n\t"
      "ror %B[ticks] \n\t"
      "ror %A[ticks] \n\t"
      : [ticks] "+r"(at.ticks), [odd] "+r"(at.odd));
  return at.ticks;
}

uint32_t now_ticks() {
  return now().ticks;
}

}  // namespace hal
