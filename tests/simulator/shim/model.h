// What differs between the two chips. Their registers lie at the same addresses (both datasheets,
// register summary); vectors, pins and sizes do not. Inside the shim a vector has the ATmega2560's
// number on either chip: the order of priority is the same.
#ifndef SIMAVR_BENCH_MODEL_H_
#define SIMAVR_BENCH_MODEL_H_

#include <stdbool.h>
#include <stdint.h>

enum chip_kind { kAtmega2560 = 0, kAtmega328p = 1, kChipKinds = 2 };
enum { kNoPin = 0xFF, kNoVector = 0xFF };

typedef struct chip_model {
  const char* name;
  uint16_t last_io;  // above lies SRAM, or reserved addresses
  uint16_t ports;    // bit per port letter index
  uint8_t timers, uarts;
  uint8_t entry_cycles;  // of an interrupt: 4, one more for a 22-bit program counter
  uint16_t eeprom_last;
  uint32_t boot_start;  // IVSEL puts the vectors here; SPM works from here on
  uint32_t page_bytes;  // of flash
  uint8_t ss_pin, scl_pin, sda_pin;
  uint8_t pin_change_port[3];  // port index of each bank whose bits are those of one port
  uint8_t external[8];         // pin of each INTn
  uint8_t outputs[6][3];       // OCnA, OCnB, OCnC
  uint8_t captures[6];         // ICPn
  const uint8_t* vectors;      // own number of each vector of the ATmega2560, or null: the same
} chip_model;

const chip_model* model_of(enum chip_kind kind);

#endif  // SIMAVR_BENCH_MODEL_H_
