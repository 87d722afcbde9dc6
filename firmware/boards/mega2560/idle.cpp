// How much of a sleep interrupts take: now and then the chip stays awake for one and counts.
#include <avr/io.h>
#include <avr/sleep.h>

#include "boards/avr/awake.h"
#include "hal/system.h"

namespace {

constexpr uint8_t kCyclesPerCount = 7;
constexpr uint8_t kCyclesPerUs = 16;

}  // namespace

namespace hal {

uint16_t idle_until_interrupt() {
  SMCR = _BV(SE);  // for whoever tells turns of the main loop by this bit
  uint16_t counts = 0;
  // 2 + 2 + 1 + 2 cycles; 65535 counts are 28 ms, and the millisecond ends it.
  __asm__ __volatile__(
      "1: adiw %[counts], 1 \n\t"
      "lds __tmp_reg__, %[awake] \n\t"
      "tst __tmp_reg__ \n\t"
      "breq 1b \n\t"
      : [counts] "+w"(counts)
      : [awake] "i"(&avr::g_awake));
  avr::g_awake = false;
  SMCR = 0;
  return static_cast<uint16_t>(uint32_t{counts} * kCyclesPerCount / kCyclesPerUs);
}

}  // namespace hal
