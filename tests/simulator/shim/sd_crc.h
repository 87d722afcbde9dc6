// CRC-7 of commands and CRC-16 (CCITT, zero start) of data blocks, SD Physical
// Layer 4.5.
#ifndef SIMAVR_BENCH_SD_CRC_H_
#define SIMAVR_BENCH_SD_CRC_H_

#include <stdint.h>

static inline uint8_t sd_crc7(const uint8_t* bytes, uint32_t count) {
  uint8_t crc = 0;
  for (uint32_t i = 0; i < count; i++) {
    for (int bit = 7; bit >= 0; bit--) {
      const uint8_t in = (uint8_t)(((bytes[i] >> bit) ^ (crc >> 6)) & 1);
      crc = (uint8_t)((crc << 1) & 0x7F);
      if (in) crc ^= 0x09;
    }
  }
  return crc;
}

static inline uint16_t sd_crc16(const uint8_t* bytes, uint32_t count) {
  uint16_t crc = 0;
  for (uint32_t i = 0; i < count; i++) {
    crc = (uint16_t)((uint8_t)(crc >> 8) | (crc << 8));
    crc ^= bytes[i];
    crc ^= (uint8_t)((crc & 0xFF) >> 4);
    crc = (uint16_t)(crc ^ (crc << 12));
    crc = (uint16_t)(crc ^ ((crc & 0xFF) << 5));
  }
  return crc;
}

#endif  // SIMAVR_BENCH_SD_CRC_H_
