// Composition root of the Mega: one instrument, its clock, and nothing else.
#include <avr/interrupt.h>

#include "app/instrument.h"
#include "boards/mega2560/board.h"

namespace {

app::Instrument g_instrument;

// Apart, so that its stack is given back.
__attribute__((noinline)) void boot() {
  g_instrument.boot();
}

// Turns of the main loop, of which there is one copy, until a row may be flown that may not now, or
// the other way round.
__attribute__((noinline)) void turns(app::RowMemory* const memory) {
  g_instrument.lend(memory);
  do {
    g_instrument.step();
  } while (g_instrument.wants_row_memory() == (memory != nullptr));
}

// What a row needs stands on the stack, and only while one may be flown. Cleared: what a row leaves
// alone would count as never touched.
__attribute__((noinline)) void turns_of_rows() {
  app::RowMemory memory = {};
  turns(&memory);
}

}  // namespace

int main() {
  mega::start_clock();
  sei();
  boot();
  for (;;) {
    turns(nullptr);
    turns_of_rows();
  }
}
