// What a row needs while it may be flown, and nothing needs else: lent by the board, which has it
// on the stack for so long (boards/mega2560/main.cpp).
#pragma once

#include <stdint.h>

#include "app/row_learning.h"
#include "core/attitude_hold.h"
#include "core/input_watch.h"

namespace app {

struct RowMemory {
  // All of it cleared.
  RowMemory()
      : watch(), least_ticks(), most_ticks(), learning(), judged(), told(false), holds(false) {}

  core::InputWatch watch;
  // Of the pulses, in ticks of 0.5 us: the card's travel and the one shown, whichever is less.
  uint16_t least_ticks[core::kCardAxes];
  uint16_t most_ticks[core::kCardAxes];
  // A row that holds teaches nothing.
  union {
    RowLearning learning;
    core::AttitudeHold hold;
  };
  frames::CardFault judged;  // the row, since memory was lent
  bool told;                 // that it began
  bool holds;                // the row, once it is judged
};

}  // namespace app
