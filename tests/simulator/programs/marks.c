// Calls a function again and again; it leaves a mark in GPIOR1.
#include "common.h"

volatile uint16_t calls;

__attribute__((noinline)) void tick(void) {
  GPIOR1 = (uint8_t)(GPIOR1 + 1);
  calls++;
}

int main(void) {
  for (;;) tick();
}
