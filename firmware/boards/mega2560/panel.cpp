// LED, buzzer and button.
#include "hal/panel.h"

#include <avr/io.h>

#include "boards/avr/interrupts_off.h"
#include "boards/mega2560/generated/pins.h"

namespace {

template <typename Pin>
void drive(const bool high) {
  const avr::InterruptsOff guard;
  Pin::direction() |= Pin::kMask;
  if (high) {
    Pin::port() |= Pin::kMask;
  } else {
    Pin::port() &= uint8_t(~Pin::kMask);
  }
}

}  // namespace

namespace hal {

void set_led(const bool on) {
  drive<pins::Led>(on);
}

void set_buzzer(const bool on) {
  drive<pins::Buzzer>(on);
}

bool button_pressed() {
  pins::Button::port() |= pins::Button::kMask;  // pull-up
  return (pins::Button::input() & pins::Button::kMask) == 0;
}

}  // namespace hal
