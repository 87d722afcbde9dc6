// What the composition root starts, in this order.
#pragma once

#include <stdint.h>

namespace mega {

void start_clock();

// Set by what the main loop has to look at: the millisecond, a scan's end that a packet waits for.
// Other interrupts (10 000 a second) let it sleep on.
extern volatile bool g_awake;

// A packet of the IMU that started no scan was taken since the last one began: it may wait for that
// scan's end, which then ends the sleep.
extern volatile bool g_packet_taken;

// Between the bus of the IMU and the converter. A packet whose number has no bit of `g_scan_mask`
// starts a scan; the main loop takes it with the packet.
constexpr uint8_t kScanUnarmed = 0xFF;
extern volatile uint8_t g_scan_mask;
extern volatile bool g_scan_waits;  // started by a packet that the main loop has not taken
bool adc_busy();
// Starts a scan into the sums that nobody reads and returns its instant, as hal::now_ticks() but 16
// bits of it. Only when not busy; takes 20 us, with interrupts as they are.
uint16_t begin_scan();
void take_scan();

// Every millisecond, in an interrupt: lets a receiver bank that stormed back in after its rest.
void tick_pulse_capture();

}  // namespace mega
