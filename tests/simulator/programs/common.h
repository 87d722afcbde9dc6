// What the test programs share: a place for results and a mark that they are complete.
#ifndef SIMAVR_PROGRAMS_COMMON_H_
#define SIMAVR_PROGRAMS_COMMON_H_

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <stdint.h>

volatile uint16_t result[64];
volatile uint8_t result_count;
volatile uint8_t finished;

static inline void put(uint16_t value) {
  result[result_count] = value;
  result_count++;
}

#endif  // SIMAVR_PROGRAMS_COMMON_H_
