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
// again as soon as interrupts are on, until the RAM is gone. So its own enable bit is cleared
// first, and only then interrupts go on: an edge of the receiver waits 24 cycles at most, entry
// included. The body sets the enable bit again as its last act, with its flag clear, and never
// turns interrupts off: the compiler restores a dozen registers before it restores SREG.
//   keep: the value that the enable register is ANDed with
#define NESTING_ISR(vector, enable_register, keep)                                          \
  extern "C" void __vector_nested_##vector(void)                                            \
      __attribute__((signal, used, externally_visible));                                    \
  ISR(vector, ISR_NAKED) {                                                                  \
    __asm__ __volatile__(                                                                   \
        "push r24 \n\t"                                                                     \
        "in r24, __SREG__ \n\t"                                                             \
        "push r24 \n\t"                                                                     \
        "lds r24, %[reg] \n\t"                                                              \
        "andi r24, %[mask] \n\t"                                                            \
        "sts %[reg], r24 \n\t"                                                              \
        "pop r24 \n\t"                                                                      \
        "out __SREG__, r24 \n\t"                                                            \
        "pop r24 \n\t"                                                                      \
        "sei \n\t"                                                                          \
        "jmp __vector_nested_" #vector " \n\t" ::[reg] "n"(_SFR_MEM_ADDR(enable_register)), \
        [mask] "M"(int(uint8_t(keep))));                                                    \
  }                                                                                         \
  void __vector_nested_##vector(void)
