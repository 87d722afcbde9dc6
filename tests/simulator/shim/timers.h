// Between the timers' counting (timers.c) and their registers
// (timer_registers.c).
#ifndef SIMAVR_BENCH_TIMERS_H_
#define SIMAVR_BENCH_TIMERS_H_

#include "chip.h"

enum timer_kind { kNormal, kClear, kFast, kUnmodelled };

uint8_t timer_first_vector(const timer* t);
uint8_t timer_overflow_vector(const timer* t);

// The last cycle not after this one at which the timer's prescaler ticked.
uint64_t timer_aligned(const chip* c, const timer* t, uint64_t cycle);

// Serves everything up to a cycle, in order.
void timer_serve(chip* c, timer* t, uint64_t cycle);
void timer_schedule(chip* c, timer* t);
// Reads mode, TOP, outputs and clock from the control registers again.
void timer_configure(chip* c, timer* t);
void timer_show_output(chip* c, timer* t, uint8_t i);
void timer_due(chip* c, void* param, uint64_t argument);

#endif  // SIMAVR_BENCH_TIMERS_H_
