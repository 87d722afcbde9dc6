// What the composition root starts, in this order.
#pragma once

#include <stdint.h>

namespace mega {

void start_clock();

// Set by what the main loop has to look at: the millisecond, a packet of the IMU. Other interrupts
// (10 000 a second) let it sleep on.
extern volatile bool g_awake;

// A packet of the IMU was taken since the last scan began: it may wait for the scan's end, which
// then ends the sleep. At 200 Hz that is 0.4 ms before the next packet.
extern volatile bool g_packet_taken;

// Every millisecond, in an interrupt: lets a receiver bank that stormed back in after its rest.
void tick_pulse_capture();

}  // namespace mega
