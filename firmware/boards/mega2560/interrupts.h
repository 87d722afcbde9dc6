// Interrupts that let the receiver's in: whatever else runs, an edge on port K is stamped within 2
// us.
#pragma once

#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdint.h>

namespace mega {

// Interrupts off for the lifetime of the object. Keep it under 2 us: 32 cycles.
class InterruptsOff {
 public:
  __attribute__((always_inline)) InterruptsOff() : status_(SREG) {
    __asm__ __volatile__("cli" ::: "memory");
  }
  __attribute__((always_inline)) ~InterruptsOff() {
    __asm__ __volatile__("" ::: "memory");
    SREG = status_;
  }
  InterruptsOff(const InterruptsOff&) = delete;
  InterruptsOff& operator=(const InterruptsOff&) = delete;

 private:
  const uint8_t status_;
};

}  // namespace mega

// An interrupt whose flag stays set until its cause is served (RXC, UDRE, TWINT) would enter itself
// again as soon as interrupts are on, until the RAM is gone. So such an interrupt (serial.cpp,
// imu_bus.cpp) clears its own enable bit first, and only then turns interrupts on: an edge of the
// receiver waits 24 cycles at most, entry included.
