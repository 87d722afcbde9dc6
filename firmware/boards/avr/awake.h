// What ends the sleep of the main loop (hal::sleep_until_interrupt).
#pragma once

namespace avr {

// Set by interrupts that the main loop has to look at; all others let it sleep on.
extern volatile bool g_awake;

}  // namespace avr
