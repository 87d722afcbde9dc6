// The flight card over USB (protocol/flight-card.md): a byte of a request at a time, each answered.
// It works between sessions only, in memory that the ring lends then, behind the block of the
// card's jobs.
#pragma once

#include <stdint.h>

#include "app/test_inputs.h"
#include "core/byte_ring.h"

namespace app {

class CardConsole {
 public:
  // Every few turns, while no status line is under way: at most a byte in and an answer out, or a
  // byte into the EEPROM.
  void step(core::ByteRing& ring,
            const PilotLink& pilot,
            core::FlightState flight,
            const frames::ConfigFrame& config,
            TestInputs& inputs,
            uint32_t now_us);

 private:
  bool live_ = false;  // what stands in the lent memory is ours
};

}  // namespace app
