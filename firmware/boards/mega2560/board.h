// What the composition root starts, and what the files of this board offer each other.
//
// Whatever else runs, an edge on port K is stamped within 2 us, so longer interrupts let others in.
// One whose flag stays set until its cause is served (RXC, UDRE, TWINT) would enter itself again as
// soon as interrupts are on, until the RAM is gone. So such an interrupt (serial.cpp, imu_bus.cpp)
// clears its own enable bit first, and only then turns interrupts on: an edge of the receiver waits
// 24 cycles at most, entry included.
#pragma once

#include <stdint.h>

namespace mega {

void start_clock();

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
