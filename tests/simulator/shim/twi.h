// The slave in a chip and the external TWI master's side of twi.c.
#ifndef SIMAVR_BENCH_TWI_H_
#define SIMAVR_BENCH_TWI_H_

#include "chip.h"

enum twi_abort { kTwiLives = 0, kTwiLetsGo = 1, kTwiHoldsSda = 2, kTwiHoldsScl = 3 };
enum twi_note {
  kTwiDone = 0,
  kTwiDied = 1,
  kTwiRefused = 2,
  kTwiStretch = 3,
  kTwiStart = 4,
  kTwiAddressed = 5,
  kTwiByte = 6
};

void twi_queue(chip* c, const twi_packet* packet);
void twi_hold(chip* c, bool sda, bool scl);

// What a master does to the slave in this chip; true: acknowledged.
void twi_slave_start(chip* c);
bool twi_slave_address(chip* c, uint8_t address_and_direction);
bool twi_slave_byte(chip* c, uint8_t value);
void twi_slave_stop(chip* c);
void twi_slave_break(chip* c);        // the master is gone in the middle of something
bool twi_slave_holds(const chip* c);  // SCL, until the program clears TWINT

#endif  // SIMAVR_BENCH_TWI_H_
