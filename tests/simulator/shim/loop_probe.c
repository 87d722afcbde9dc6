// Turns of the program's main loop, seen at the sleep mode register: a program that sleeps at the
// end of every turn sets SE before it and clears it behind it. Costs the program nothing.
#include "bench.h"

enum { kBins = 1 << 16, kCyclesPerBin = 16 };

// Times in bins of 1 us; the last bin collects the rest.
typedef struct loop_stats {
  uint64_t turns;
  uint64_t period_max, work_max;  // cycles
  uint32_t period[kBins];         // from the end of one sleep to the end of the next
  uint32_t work[kBins];           // from the end of a sleep to the next
  uint64_t woke, slept;           // not counted again: where this turn began and ended
} loop_stats;

static void count(uint32_t* bins, uint64_t* max, uint64_t cycles) {
  const uint64_t bin = cycles / kCyclesPerBin;
  bins[bin < kBins ? bin : kBins - 1]++;
  if (cycles > *max) *max = cycles;
}

static void write_sleep_mode(chip* c, uint16_t address, uint8_t value, void* param) {
  loop_stats* const s = param;
  const bool enabled = c->avr->data[address] & 1;
  c->avr->data[address] = value;
  const uint64_t now = chip_now(c);
  if ((value & 1) && !enabled) {
    s->slept = now;
  } else if (!(value & 1) && enabled) {
    if (s->woke != 0 && s->slept > s->woke) {
      s->turns++;
      count(s->period, &s->period_max, now - s->woke);
      count(s->work, &s->work_max, s->slept - s->woke);
    }
    s->woke = now;
  }
}

BENCH_API loop_stats* bench_loop_probe(chip* c);

loop_stats* bench_loop_probe(chip* c) {
  loop_stats* const s = chip_allocate(c, sizeof *s);
  hook_write(c, REG_SMCR, write_sleep_mode, s);
  return s;
}
