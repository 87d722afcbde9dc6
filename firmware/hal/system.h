// Reset, watchdog, sleep: what concerns the whole chip.
#pragma once

#include <stdint.h>

namespace hal {

// As frames.toml numbers them.
enum class ResetSource : uint8_t { kUnknown, kPowerOn, kExternal, kBrownOut, kWatchdog, kCrash };
ResetSource reset_source();

// Address of the instruction at which the last run crashed; 0: it did not.
uint32_t crash_address();

// A mark in memory that a reset keeps and a power cut loses: set while recording in flight.
void set_flight_mark(bool flying);
bool flight_mark();

// From here the chip resets itself 48 ms after the last feed_watchdog(), 64 ms if interrupts are
// off. The IMU's restarts its program after 0.5 s and resets itself after 1 s.
void start_watchdog();
void feed_watchdog();

// Sleeps until the next interrupt, 1 ms at most. Main loop only.
void sleep_until_interrupt();

// The same without sleep: counts what interrupts leave of the time until then, in us. Sleep itself
// cannot tell: interrupts that do not end it are part of it.
uint16_t idle_until_interrupt();

// Stack never touched since boot; 65535: unknown.
uint16_t stack_free_bytes();

// Restarts by the watchdog or a reset since the supply came; the IMU's board only.
uint16_t restarts();

// What the image calls itself, at most 11 characters (frames.toml, identity.board); in program
// memory.
const char* board_name();

// The hash by which the image is known (firmware/toolchain/image_hash.py); 0: it has none.
uint32_t image_hash();

}  // namespace hal
