// The log of everything observable, the seeded random numbers and the device
// memory of the chip.
#include <stdlib.h>

#include "chip.h"

void log_add_at(chip* c, uint64_t cycle, uint16_t kind, uint32_t source, uint32_t value) {
  if (c->log_count == c->log_capacity) {
    c->log_capacity = c->log_capacity ? 2 * c->log_capacity : 4096;
    c->log = realloc(c->log, c->log_capacity * sizeof *c->log);
    if (!c->log) abort();
  }
  c->log[c->log_count++] = (log_record){cycle, kind, (uint16_t)source, value};
}

void log_add(chip* c, uint16_t kind, uint32_t source, uint32_t value) {
  log_add_at(c, chip_now(c), kind, source, value);
}

void fault_add(chip* c, enum fault what, uint32_t detail) {
  // A runaway program raises thousands: the first hundred tell the story, the
  // count tells the rest.
  if (c->fault_count++ < 100) log_add(c, kLogFault, (uint32_t)what, detail);
}

typedef struct owned {
  struct owned* next;
  max_align_t bytes[];
} owned;

void* chip_allocate(chip* c, size_t size) {
  owned* const block = calloc(1, sizeof *block + size);
  if (!block) abort();
  block->next = c->owned;
  c->owned = block;
  return block->bytes;
}

typedef struct owned_array {
  struct owned_array* next;
  void** pointer;
} owned_array;

void chip_own(chip* c, void** pointer) {
  owned_array* const array = chip_allocate(c, sizeof *array);
  array->pointer = pointer;
  array->next = c->owned_arrays;
  c->owned_arrays = array;
}

void chip_free_owned(chip* c) {
  for (owned_array* a = c->owned_arrays; a; a = a->next) free(*a->pointer);
  while (c->owned) {
    owned* const block = c->owned;
    c->owned = block->next;
    free(block);
  }
}

uint32_t chip_random(chip* c) {
  // xorshift64*: Vigna, "An experimental exploration of Marsaglia's xorshift
  // generators", 2016
  c->random_state ^= c->random_state >> 12;
  c->random_state ^= c->random_state << 25;
  c->random_state ^= c->random_state >> 27;
  return (uint32_t)((c->random_state * UINT64_C(2685821657736338717)) >> 32);
}
