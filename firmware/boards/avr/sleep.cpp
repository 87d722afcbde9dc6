// Sleep, and the watchdog's food: what of hal/system.h is the same on both chips.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>

#include "boards/avr/awake.h"
#include "hal/system.h"

namespace hal {

void feed_watchdog() {
  wdt_reset();
}

void sleep_until_interrupt() {
  SMCR = _BV(SE);  // idle
  for (;;) {
    cli();
    if (avr::awake()) {
      break;
    }
    sei();  // takes effect behind the next instruction: no interrupt can slip in between
    sleep_cpu();
  }
  avr::fall_asleep();
  sei();
  SMCR = 0;
}

}  // namespace hal
