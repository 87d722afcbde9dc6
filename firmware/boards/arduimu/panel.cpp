// The red LED of the board.
#include "hal/panel.h"

#include <avr/io.h>

#include "boards/arduimu/board.h"

namespace hal {

void set_led(const bool on) {
  DDRD |= arduimu::kLed;
  if (on) {
    PORTD |= arduimu::kLed;
  } else {
    PORTD &= uint8_t(~arduimu::kLed);
  }
}

}  // namespace hal
