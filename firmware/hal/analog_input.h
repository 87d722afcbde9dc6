// The scan of all analogue channels: four rounds over eleven slots, 104 us each, by interrupt.
#pragma once

#include <stdint.h>

namespace hal {

// Slots in the order of the identification frame (alpha_a ... pot_rudder), the servo rail last.
constexpr uint8_t kAnalogSlots = 11;
constexpr uint8_t kAnalogRounds = 4;
constexpr uint8_t kAnalogRail = 10;
constexpr uint16_t kConversionUs = 104;
constexpr uint16_t kScanUs = kConversionUs * kAnalogSlots * kAnalogRounds;  // 4576

// At boot, and again when a scan is not done long after its time: the converter was disturbed. The
// sums of that scan are 0, and the supply is unknown until it is measured anew within two seconds.
void start_analog();

// Conversion n of a scan holds the voltage of 12 us after the scan's start plus n * 104 us.

// Lets the next packet of the IMU that core::starts_scan accepts with this mask start a scan at its
// STOP, in the bus's interrupt, if none runs then; ImuPacket::scan_after_us tells. Once, and only
// when the last packet that did was released. Main loop only.
void arm_scan(uint8_t mask);

// Starts a scan now, when none runs, and gives its instant; nothing is armed afterwards. False: a
// packet has just started one. Waits for the supply's measurement, which takes 208 us
// where it was asked for; one that does not end in 300 us is given up as by start_analog(). Main
// loop only.
bool start_scan(uint32_t* started_us);

// The scan of the last start_scan(), or of the last packet released that started one. It is done
// once all conversions are in; a sum is that of the four conversions of a slot, 0 to 4092, and
// stays until the scan behind it is released or started. Main loop only.
bool scan_done();
uint16_t scan_sum(uint8_t slot);

// Asks for one measurement of the supply, behind the next scan.
void measure_supply();

// The analogue supply as measured against the chip's reference between scans, in mV; 0: unknown.
uint16_t avcc_mv();

}  // namespace hal
