// Goes through everything the card model claims, one result after the other.
#include "sd.h"

static uint8_t block[512];
volatile uint8_t csd[16];
volatile uint16_t busy_ticks[4];

static void fill(uint8_t seed) {
  for (uint16_t i = 0; i < 512; i++) block[i] = (uint8_t)(seed + i * 7);
}

static uint16_t busy(void) {
  const uint16_t from = TCNT1;
  while (spi(0xFF) == 0) {
  }
  return TCNT1 - from;
}

int main(void) {
  TCCR1B = _BV(CS11) | _BV(CS10);  // 4 us
  put(sd_init());
  put(high_capacity);
  put(command(9, 0));
  put(receive((uint8_t*)csd, 16));
  fill(1);
  put(command(24, address(100)));  // single write
  put(send(0xFE, block, crc16(block, 512)));
  busy_ticks[0] = busy();
  put(command(13, 0) | spi(0xFF) << 8);
  fill(2);
  put(command(24, address(101)));
  put(send(0xFE, block, 0x1234));  // wrong CRC
  wait_ready(1000);
  put(command(17, address(100)));
  put(receive(block, 512));
  put(block[0] | block[511] << 8);
  put(application(23, 4));
  put(command(25, address(200)));  // four blocks in a stream
  for (uint8_t i = 0; i < 4; i++) {
    fill((uint8_t)(10 + i));
    put(send(0xFC, block, crc16(block, 512)));
    if (i == 3)
      busy_ticks[1] = busy();
    else
      wait_ready(60000);
  }
  spi(0xFD);
  spi(0xFF);
  wait_ready(60000);
  put(command(18, address(200)));  // read two back, stop
  put(receive(block, 512));
  put(block[0]);
  put(receive(block, 512));
  put(block[0]);
  put(command(12, 0));
  wait_ready(60000);
  put(command(32, address(200)));
  put(command(33, address(201)));
  put(command(38, 0));
  wait_ready(60000);
  put(command(17, address(201)));
  receive(block, 512);
  put(block[5]);
  put(command(17, high_capacity ? 0xFFFFFFUL : 3));  // beyond the end, or not on a block
  put(command(99 & 0x3F, 0));                        // unknown
  finished = 1;
  for (;;) {
  }
}
