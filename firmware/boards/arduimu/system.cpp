// Watchdog and restart.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>

#include "boards/avr/interrupts_off.h"
#include "hal/system.h"

namespace {

constexpr uint16_t kMark = 0x4D49;

// Kept over a reset, lost with the supply; the mark tells which.
__attribute__((section(".noinit"))) uint16_t g_mark;
__attribute__((section(".noinit"))) uint16_t g_resets;

}  // namespace

extern "C" {

void arduimu_init3(void) __attribute__((naked, used, section(".init3")));
void arduimu_init3(void) {
  MCUSR = 0;
  WDTCSR = _BV(WDCE) | _BV(WDE);
  WDTCSR = 0;
}

}  // extern "C"

// The first time-out, with interrupts on, is no reset of the chip: the program starts again at its
// first instruction, past the bootloader; every register that matters is written at the start. A
// program that hangs with interrupts off cannot come here: the second time-out resets the chip.
ISR(WDT_vect, ISR_NAKED) {
  __asm__ __volatile__(
      "clr __zero_reg__ \n\t"
      "jmp 0 \n\t");
}

namespace hal {

void start_watchdog() {
  if (g_mark != kMark) {
    g_mark = kMark;
    g_resets = 0;
  } else {
    ++g_resets;
  }
  const avr::InterruptsOff guard;
  wdt_reset();
  WDTCSR = _BV(WDCE) | _BV(WDE);
  WDTCSR = _BV(WDE) | _BV(WDIE) | _BV(WDP2) | _BV(WDP0);  // 0.5 s, and as much again to the reset
}

uint16_t restarts() {
  return g_resets;
}

}  // namespace hal
