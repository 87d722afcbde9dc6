// The pressure sensor's bus: this side is its only master. No call waits for the bus.
#pragma once

#include <stdint.h>

namespace hal {

enum class BusStatus : uint8_t {
  kBusy,   // under way
  kDone,   // the last transfer ended well, or none was asked for
  kNoAck,  // nobody answered
  kStuck,  // a line is held low
};

constexpr uint8_t kBaroBusBytes = 24;  // longest read

void start_baro_bus();

// Begin a transfer; only when the status is not kBusy. Main loop only.
void baro_bus_write(uint8_t address, uint8_t reg, uint8_t value);
void baro_bus_read(uint8_t address, uint8_t reg, uint8_t count);

// Carries the transfer on by one byte at most (0.1 ms) and says how it stands.
BusStatus step_baro_bus();

// Bytes of the last read, valid from kDone to the next transfer.
const uint8_t* baro_bus_bytes();

}  // namespace hal
