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

void start_analog();

// Starts a scan and returns the instant at which its first conversion starts: conversion n holds
// the voltage of 12 us after that instant plus n * 104 us. Only when no scan is running.
// Main loop only.
uint32_t start_scan();

// True once all conversions of the last scan are in. Main loop only.
bool scan_done();

// Sum of the four conversions of a slot, 0 to 4092. Valid from scan_done() to the next start.
uint16_t scan_sum(uint8_t slot);

// The analogue supply as measured against the chip's reference between scans, in mV; 0: unknown.
uint16_t avcc_mv();

}  // namespace hal
