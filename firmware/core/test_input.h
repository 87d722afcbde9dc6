// The shapes of a flight card's row, in whole numbers as protocol/flight-card.md gives them: the
// host computes the same to the bit.
#pragma once

#include <stdint.h>

#include "core/flight_card.h"

namespace core {

// Sine of phase / 65536 turns, in 1/16384.
int16_t sin14(uint16_t phase);

// What a multisine's first harmonic turns in a millisecond, 2^32 a turn: reckoned once for a row,
// as the division takes 640 cycles.
uint32_t turns_per_ms(const CardRow& row);
// Deflections of the axes `t_ms` behind the beginning of the shape, in ticks of 0.5 us; 0 from
// duration_ms on. The row is good (judge_row).
void deflect(const CardRow& row, uint32_t turns, uint16_t t_ms, int16_t* ticks);

}  // namespace core
