// The external TWI master's side of twi.c.
#ifndef SIMAVR_BENCH_TWI_H_
#define SIMAVR_BENCH_TWI_H_

#include "chip.h"

enum twi_abort { kTwiLives = 0, kTwiLetsGo = 1, kTwiHoldsSda = 2, kTwiHoldsScl = 3 };
enum twi_note { kTwiDone = 0, kTwiDied = 1, kTwiRefused = 2, kTwiStretch = 3 };

void twi_queue(chip* c, const twi_packet* packet);
void twi_hold(chip* c, bool sda, bool scl);

#endif  // SIMAVR_BENCH_TWI_H_
