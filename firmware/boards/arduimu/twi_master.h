// The only master of the bus to the Mega: a transfer runs in interrupts and ends in time whatever
// the others do. Main loop only.
#pragma once

#include <stdint.h>

namespace arduimu {

enum class TwiStatus : uint8_t { kBusy, kDone, kNack, kStuck };

constexpr uint16_t kTwiStepUs = 1000;   // without a step of the hardware
constexpr uint16_t kTwiTotalUs = 4500;  // a Mega that stretches every byte costs one sample

void start_twi();

// Writes `out_size` bytes, then, if `in_size` is not 0, reads behind a repeated START. The buffer
// is used for both and lives until the end. False while a transfer is under way.
bool begin_transfer(uint8_t address, uint8_t* buffer, uint8_t out_size, uint8_t in_size);

// The same without a read, START at `start_us`: waits for it.
bool begin_transfer_at(uint32_t start_us, uint8_t address, uint8_t* buffer, uint8_t out_size);

// Looks at the clock: a transfer that stands still is ended, its lines freed by up to nine clocks
// and a STOP.
TwiStatus poll_transfer();

// Both in one, for registers of a sensor; 4.5 ms at most.
TwiStatus transfer(uint8_t address, uint8_t* buffer, uint8_t out_size, uint8_t in_size);

}  // namespace arduimu
