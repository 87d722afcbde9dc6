// Composition root of the Mega: one instrument, its clock, and nothing else.
#include <avr/interrupt.h>

#include "app/instrument.h"
#include "boards/mega2560/board.h"

namespace {

app::Instrument g_instrument;

}  // namespace

int main() {
  mega::start_clock();
  sei();
  g_instrument.boot();
  for (;;) {
    g_instrument.step();
  }
}
