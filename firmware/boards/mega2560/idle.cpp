// How much of a sleep interrupts take: now and then the chip stays awake for one and counts.
#include <avr/io.h>
#include <avr/sleep.h>

#include "boards/avr/awake.h"
#include "hal/system.h"

namespace {

constexpr uint8_t kCyclesPerCount = 5;
constexpr uint8_t kCyclesPerUs = 16;

}  // namespace

namespace hal {

uint16_t idle_until_interrupt() {
  SMCR = _BV(SE);  // for whoever tells turns of the main loop by this bit
  uint16_t counts = 0;
  // 2 + 1 + 2 cycles; 65535 counts are 20 ms, and the millisecond ends it.
  __asm__ __volatile__(
      "1: adiw %[counts], 1 \n\t"
      "sbis %[awake], %[bit] \n\t"
      "rjmp 1b \n\t"
      : [counts] "+w"(counts)
      : [awake] "I"(_SFR_IO_ADDR(GPIOR0)), [bit] "I"(avr::kAwakeBit));
  avr::fall_asleep();
  SMCR = 0;
  return static_cast<uint16_t>(uint32_t{counts} * kCyclesPerCount / kCyclesPerUs);
}

}  // namespace hal
