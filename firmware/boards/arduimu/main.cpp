// Composition root of the IMU: one unit, its clock and its bus, and nothing else.
#include <avr/interrupt.h>

#include "boards/arduimu/board.h"
#include "hal/bus_master.h"
#include "imu/unit.h"

namespace {

imu::Unit g_unit;

}  // namespace

int main() {
  arduimu::start_clock();
  // Before interrupts: the watchdog restarts the program alone, and a transfer of the last run may
  // be under way, into memory that is another's now.
  hal::start_bus_master();
  sei();
  g_unit.boot();
  for (;;) {
    g_unit.step();
  }
}
