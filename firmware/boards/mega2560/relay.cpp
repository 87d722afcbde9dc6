// Heartbeat and sense line of the relay; hw/relay.md has the circuit.
#include "hal/relay.h"

#include <avr/io.h>

#include "boards/avr/interrupts_off.h"
#include "boards/mega2560/generated/pins.h"

namespace hal {

void toggle_heartbeat() {
  const avr::InterruptsOff guard;  // port H is beyond sbi: a write is read, change, write
  pins::Heartbeat::direction() |= pins::Heartbeat::kMask;
  pins::Heartbeat::input() = pins::Heartbeat::kMask;  // writing a one to PIN turns the line over
}

bool relay_engaged() {
  const avr::InterruptsOff guard;
  pins::RelaySense::port() |= pins::RelaySense::kMask;  // pull-up; the contact pulls it to ground
  return (pins::RelaySense::input() & pins::RelaySense::kMask) == 0;
}

}  // namespace hal
