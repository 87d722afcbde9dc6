// What the pilot sees, hears and presses.
#pragma once

namespace hal {

void set_led(bool on);
void set_buzzer(bool on);

// The level of the button, not debounced.
bool button_pressed();

}  // namespace hal
