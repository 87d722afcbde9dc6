// The IMU's end of the bus to the Mega: its only master. A transfer runs in interrupts and ends in
// time whatever the others do. The IMU's board only, main loop only.
#pragma once

#include <stdint.h>

namespace hal {

enum class TransferStatus : uint8_t {
  kBusy,   // under way
  kDone,   // the last one ended well, or none was asked for
  kNoAck,  // nobody answered
  kStuck,  // a line or the other end stood still; the lines were freed
};

constexpr uint16_t kTransferStepUs = 1000;   // without a step of the hardware
constexpr uint16_t kTransferTotalUs = 4500;  // a Mega that stretches every byte costs one sample

void start_bus_master();

// Writes `out_size` bytes, then, if `in_size` is not 0, reads behind a repeated START. The buffer
// is used for both and lives until the end. False while a transfer is under way.
bool begin_transfer(uint8_t address, uint8_t* buffer, uint8_t out_size, uint8_t in_size);

// The same without a read, START at `start_us`: waits for it.
bool begin_transfer_at(uint32_t start_us, uint8_t address, uint8_t* buffer, uint8_t out_size);

// Looks at the clock: a transfer that stands still is ended, its lines freed by up to nine clocks
// and a STOP.
TransferStatus poll_transfer();

// Both in one, for registers of a sensor; waits for the transfer before and its own, 4.5 ms each
// at most.
TransferStatus transfer(uint8_t address, uint8_t* buffer, uint8_t out_size, uint8_t in_size);

}  // namespace hal
