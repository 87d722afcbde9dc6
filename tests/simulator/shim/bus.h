// The I2C bus between a chip that is its master, a chip that is a slave on it, and register chips.
// Byte by byte in the master's bit time; whoever holds SCL holds it.
#ifndef SIMAVR_BENCH_BUS_H_
#define SIMAVR_BENCH_BUS_H_

#include "chip.h"

typedef struct twi_bus twi_bus;

// A chip of registers with an address pointer.
typedef struct bus_device {
  uint8_t address;
  bool present;
  void* param;
  uint8_t (*read)(chip* c, void* param, uint8_t number);
  void (*write)(chip* c, void* param, uint8_t number, uint8_t value);
  uint8_t (*next)(uint8_t number);              // where the pointer goes; null: one further
  void (*busy)(chip* c, void* param, bool on);  // between START and STOP; null: does not care
  uint8_t pointer;
  bool addressed, pointing;
  struct bus_device* following;
} bus_device;

void bus_add(twi_bus* b, bus_device* d);
chip* bus_master(const twi_bus* b);
// What the master's program writes to TWCR.
void bus_control(twi_bus* b, uint8_t value);
// The master was reset, or lost its power.
void bus_abandon(twi_bus* b);
void bus_leave(chip* c);
void bus_run(twi_bus* b, chip* lead, uint64_t until);

#endif  // SIMAVR_BENCH_BUS_H_
