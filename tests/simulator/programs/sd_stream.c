// Writes blocks in one endless stream while the card lets it; reopens the stream after a reject;
// gives up and tries from the start when the card is gone.
#include "sd.h"

static uint8_t block[512];
volatile uint32_t next_block;
volatile uint8_t careless;
volatile uint16_t rejects, inits, answers_missing;
volatile uint32_t longest_busy_us;

static uint8_t open_stream(void) {
  wait_ready(60000);
  return command(25, address(1000 + next_block)) == 0;
}

int main(void) {
  TCCR1B = _BV(CS11);
  for (;;) {
    inits++;
    if (sd_init() != 0) continue;
    if (!open_stream()) continue;
    for (;;) {
      for (uint16_t i = 0; i < 512; i++) block[i] = (uint8_t)(next_block + i);
      const uint8_t answer = send(0xFC, block, crc16(block, 512));
      if (answer == 5) {
        next_block++;
      } else if (answer == 0x0B || answer == 0x0D) {
        rejects++;
        if (careless) continue;  // sends on without ending the stream, which a card need not take
        command(12, 0);
        if (!open_stream()) break;
      } else {
        answers_missing++;
        break;
      }
      uint32_t waited = 0;
      uint16_t last = TCNT1;
      while (spi(0xFF) == 0) {
        const uint16_t now = TCNT1;
        waited += (uint16_t)(now - last);
        last = now;
      }
      if (waited / 2 > longest_busy_us) longest_busy_us = waited / 2;
    }
  }
}
