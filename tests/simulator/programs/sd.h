// A plain, waiting SD host of its own for the card model's tests (SD Physical Layer, chapter 7).
#ifndef SIMAVR_PROGRAMS_SD_H_
#define SIMAVR_PROGRAMS_SD_H_

#include "common.h"

static uint8_t high_capacity;

static inline uint8_t spi(uint8_t out) {
  SPDR = out;
  while (!(SPSR & _BV(SPIF))) {
  }
  return SPDR;
}

static inline void select(uint8_t on) {
  if (on)
    PORTB &= (uint8_t)~_BV(PB0);
  else
    PORTB |= _BV(PB0);
}

static inline uint8_t crc7(const uint8_t* bytes) {
  uint8_t crc = 0;
  for (uint8_t i = 0; i < 5; i++) {
    uint8_t d = bytes[i];
    for (uint8_t b = 0; b < 8; b++) {
      crc <<= 1;
      if ((d ^ crc) & 0x80) crc ^= 0x09;
      d <<= 1;
    }
  }
  return (uint8_t)(crc << 1) | 1;
}

static inline uint16_t crc16(const uint8_t* bytes, uint16_t count) {
  uint16_t crc = 0;
  while (count--) {
    crc ^= (uint16_t)*bytes++ << 8;
    for (uint8_t b = 0; b < 8; b++) crc = crc & 0x8000 ? (uint16_t)(crc << 1) ^ 0x1021 : crc << 1;
  }
  return crc;
}

static inline uint8_t wait_ready(uint16_t tries) {
  while (tries--) {
    if (spi(0xFF) == 0xFF) return 1;
  }
  return 0;
}

static inline uint8_t command(uint8_t number, uint32_t argument) {
  uint8_t frame[6] = {(uint8_t)(0x40 | number),
                      (uint8_t)(argument >> 24),
                      (uint8_t)(argument >> 16),
                      (uint8_t)(argument >> 8),
                      (uint8_t)argument,
                      0};
  frame[5] = crc7(frame);
  spi(0xFF);
  for (uint8_t i = 0; i < 6; i++) spi(frame[i]);
  if (number == 12) spi(0xFF);
  for (uint8_t i = 0; i < 9; i++) {
    const uint8_t r = spi(0xFF);
    if (!(r & 0x80)) return r;
  }
  return 0xFF;
}

static inline uint8_t application(uint8_t number, uint32_t argument) {
  command(55, 0);
  return command(number, argument);
}

static inline uint8_t sd_init(void) {
  DDRB |= _BV(PB0) | _BV(PB1) | _BV(PB2);
  select(0);
  SPCR = _BV(SPE) | _BV(MSTR) | _BV(SPR1) | _BV(SPR0);
  for (uint8_t i = 0; i < 10; i++) spi(0xFF);
  select(1);
  if (command(0, 0) != 1) return 1;
  uint8_t version_2 = command(8, 0x1AA) == 1;
  if (version_2) {
    uint8_t echo[4];
    for (uint8_t i = 0; i < 4; i++) echo[i] = spi(0xFF);
    if (echo[2] != 1 || echo[3] != 0xAA) return 2;
  }
  uint16_t tries = 0;
  while (application(41, version_2 ? 0x40000000UL : 0) != 0) {
    if (++tries == 2000) return 3;
  }
  if (command(58, 0) != 0) return 4;
  const uint8_t ocr = spi(0xFF);
  for (uint8_t i = 0; i < 3; i++) spi(0xFF);
  high_capacity = (ocr & 0x40) != 0;
  if (!(ocr & 0x80)) return 5;
  command(59, 1);
  if (!high_capacity && command(16, 512) != 0) return 6;
  SPCR = _BV(SPE) | _BV(MSTR);
  SPSR = _BV(SPI2X);
  return 0;
}

static inline uint32_t address(uint32_t block) {
  return high_capacity ? block : block * 512;
}

static inline uint8_t receive(uint8_t* to, uint16_t count) {
  uint8_t token;
  uint16_t tries = 50000;
  while ((token = spi(0xFF)) == 0xFF) {
    if (--tries == 0) return 0xFF;
  }
  if (token != 0xFE) return token;
  for (uint16_t i = 0; i < count; i++) to[i] = spi(0xFF);
  uint16_t crc = (uint16_t)spi(0xFF) << 8;
  crc |= spi(0xFF);
  return crc == crc16(to, count) ? 0 : 0xC0;
}

// The data response: 5 accepted, 0x0B CRC, 0x0D write error.
static inline uint8_t send(uint8_t token, const uint8_t* bytes, uint16_t crc) {
  spi(token);
  for (uint16_t i = 0; i < 512; i++) spi(bytes[i]);
  spi((uint8_t)(crc >> 8));
  spi((uint8_t)crc);
  return spi(0xFF) & 0x1F;
}

#endif  // SIMAVR_PROGRAMS_SD_H_
