// Bit-banged I2C on PA2 (SDA) and PA3 (SCL), open drain by DDR; reads a BMP085 the waiting way.
#include <util/delay.h>

#include "common.h"

volatile uint8_t calibration[22];
volatile uint8_t chip_id;
volatile uint16_t temperature, too_early;
volatile uint32_t pressure;
volatile uint8_t missing;

#define SDA _BV(PA2)
#define SCL _BV(PA3)

static void half(void) {
  _delay_us(2.5);
}
static void sda(uint8_t high) {
  if (high)
    DDRA &= (uint8_t)~SDA;
  else
    DDRA |= SDA;
}
static void scl(uint8_t high) {
  if (high)
    DDRA &= (uint8_t)~SCL;
  else
    DDRA |= SCL;
}
static void start(void) {
  sda(1);
  half();
  scl(1);
  half();
  sda(0);
  half();
  scl(0);
  half();
}
static void stop(void) {
  sda(0);
  half();
  scl(1);
  half();
  sda(1);
  half();
}
static uint8_t bit(uint8_t out) {
  sda(out);
  half();
  scl(1);
  half();
  const uint8_t in = (PINA & SDA) != 0;
  scl(0);
  half();
  return in;
}
static uint8_t write(uint8_t byte) {
  for (uint8_t i = 0; i < 8; i++, byte <<= 1) bit(byte & 0x80);
  return !bit(1);
}
static uint8_t read(uint8_t more) {
  uint8_t byte = 0;
  for (uint8_t i = 0; i < 8; i++) byte = (uint8_t)(byte << 1) | bit(1);
  bit(!more);
  return byte;
}
static uint8_t read_registers(uint8_t from, uint8_t* to, uint8_t count) {
  start();
  if (!write(0xEE) || !write(from)) {
    stop();
    return 0;
  }
  start();
  write(0xEF);
  while (count--) *to++ = read(count != 0);
  stop();
  return 1;
}
static void set(uint8_t address, uint8_t value) {
  start();
  write(0xEE);
  write(address);
  write(value);
  stop();
}

int main(void) {
  PORTA = 0;
  for (;;) {
    uint8_t b[3];
    missing = !read_registers(0xD0, b, 1);
    chip_id = b[0];
    read_registers(0xAA, (uint8_t*)calibration, 22);
    set(0xF4, 0x2E);
    read_registers(0xF6, b, 2);
    too_early = (uint16_t)(b[0] << 8 | b[1]);
    _delay_ms(5);
    read_registers(0xF6, b, 2);
    temperature = (uint16_t)(b[0] << 8 | b[1]);
    set(0xF4, 0xF4);
    _delay_ms(26);
    read_registers(0xF6, b, 3);
    pressure = ((uint32_t)b[0] << 16 | (uint16_t)(b[1] << 8) | b[2]) >> 5;
    finished++;
  }
}
