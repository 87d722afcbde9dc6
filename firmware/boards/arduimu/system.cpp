// Watchdog, restart, EEPROM.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>
#include <util/atomic.h>

#include "boards/arduimu/board.h"

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

// Not a reset of the chip: the board's bootloader (ATmegaBOOT) leaves the watchdog running and
// would be reset by it for ever. The program starts again at its first instruction instead, past
// the bootloader; every register that matters is written at the start.
ISR(WDT_vect, ISR_NAKED) {
  __asm__ __volatile__(
      "clr __zero_reg__ \n\t"
      "jmp 0 \n\t");
}

namespace arduimu {

void start_watchdog() {
  if (g_mark != kMark) {
    g_mark = kMark;
    g_resets = 0;
  } else {
    ++g_resets;
  }
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    wdt_reset();
    WDTCSR = _BV(WDCE) | _BV(WDE);
    WDTCSR = _BV(WDIE) | _BV(WDP2) | _BV(WDP0);  // interrupt only, 0.5 s
  }
}

void feed_watchdog() {
  wdt_reset();
}

uint16_t resets() {
  return g_resets;
}

uint8_t read_eeprom(const uint16_t address) {
  while (!eeprom_ready()) {  // 3.4 ms, and only when a write was just begun
  }
  EEAR = address;
  EECR |= _BV(EERE);
  return EEDR;
}

bool eeprom_ready() {
  return (EECR & _BV(EEPE)) == 0;
}

void write_eeprom(const uint16_t address, const uint8_t value) {
  if (read_eeprom(address) == value) {
    return;
  }
  EEAR = address;
  EEDR = value;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {  // EEPE must follow EEMPE within four cycles
    EECR = _BV(EEMPE);
    EECR = _BV(EEMPE) | _BV(EEPE);
  }
}

}  // namespace arduimu
