// A critical section: what the main loop and an interrupt, or two interrupts, share.
#pragma once

#include <avr/io.h>
#include <stdint.h>

namespace avr {

// Interrupts off for the lifetime of the object, then as they were. Keep it under 2 us, 32 cycles:
// the Mega's receiver edges are stamped by an interrupt, and so are the IMU's samples.
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

}  // namespace avr
