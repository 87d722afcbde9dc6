// Compensation of the two pressure sensors in integers, and the sanity of what they are fed with.
// BMP085: Bosch BST-BMP085-DS000 section 3.5. BMP280: Bosch BST-BMP280-DS001 section 8.2 (32 bit).
#pragma once

#include <stdint.h>

namespace core {

struct BaroValue {
  uint32_t static_pressure = 0;     // 1/16 Pa; 0 is none
  int16_t temperature = INT16_MIN;  // 0.01 degC
};

// AC1..AC6 B1 B2 MB MC MD as the frame `baro_coefficients` holds them.
constexpr uint8_t kBmp085Words = 11;
// dig_T1..T3 dig_P1..P9.
constexpr uint8_t kBmp280Words = 12;

// False when a word is 0 or 0xFFFF, as a missing or stuck chip reads.
bool bmp085_words_sane(const uint16_t* words);
// dig_T1 and dig_P1 must be neither; others only not all alike.
bool bmp280_words_sane(const uint16_t* words);

// `oss` 0 to 3; `up` already shifted to 16 + oss bits. None when a division by zero would follow
// or the result is outside -50 to 100 degC, 20 to 120 kPa.
BaroValue bmp085_compensate(const uint16_t* words, uint8_t oss, uint32_t ut, uint32_t up);
BaroValue bmp280_compensate(const uint16_t* words, uint32_t adc_t, uint32_t adc_p);

}  // namespace core
