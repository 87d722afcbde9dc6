#include "core/baro.h"

namespace core {
namespace {

// All sums and products wrap: what a damaged chip sends must not be undefined behaviour. The
// result is judged at the end.
uint32_t word(uint16_t value) {
  return static_cast<uint32_t>(static_cast<int32_t>(static_cast<int16_t>(value)));
}

uint32_t asr(uint32_t value, uint8_t by) {
  return static_cast<uint32_t>(static_cast<int32_t>(value) >> by);
}

uint32_t divide(uint32_t value, uint32_t by) {
  return static_cast<uint32_t>(static_cast<int32_t>(value) / static_cast<int32_t>(by));
}

BaroValue judged(int32_t pressure_pa, int32_t temperature_cdegc) {
  BaroValue value;
  if (pressure_pa >= 20000L && pressure_pa <= 120000L && temperature_cdegc >= -5000 &&
      temperature_cdegc <= 10000) {
    value.static_pressure = static_cast<uint32_t>(pressure_pa) * 16;
    value.temperature = static_cast<int16_t>(temperature_cdegc);
  }
  return value;
}

}  // namespace

bool bmp085_words_sane(const uint16_t* words) {
  for (uint8_t i = 0; i < kBmp085Words; ++i) {
    if (words[i] == 0 || words[i] == 0xFFFF) {
      return false;
    }
  }
  return true;
}

bool bmp280_words_sane(const uint16_t* words) {
  bool alike = true;
  for (uint8_t i = 1; i < kBmp280Words; ++i) {
    alike = alike && words[i] == words[0];
  }
  const uint16_t t1 = words[0];
  const uint16_t p1 = words[3];
  return !alike && t1 != 0 && t1 != 0xFFFF && p1 != 0 && p1 != 0xFFFF;
}

BaroValue bmp085_compensate(const uint16_t* words, uint8_t oss, uint32_t ut, uint32_t up) {
  const uint32_t ac1 = word(words[0]);
  const uint32_t ac2 = word(words[1]);
  const uint32_t ac3 = word(words[2]);
  const uint32_t ac4 = words[3];
  const uint32_t ac5 = words[4];
  const uint32_t ac6 = words[5];
  const uint32_t b1 = word(words[6]);
  const uint32_t b2 = word(words[7]);
  const uint32_t mc = word(words[9]);
  const uint32_t md = word(words[10]);

  uint32_t x1 = asr((ut - ac6) * ac5, 15);
  if (x1 + md == 0) {
    return BaroValue();
  }
  uint32_t x2 = divide(mc * 2048, x1 + md);
  const uint32_t b5 = x1 + x2;
  const int32_t temperature_ddegc = static_cast<int32_t>(asr(b5 + 8, 4));

  const uint32_t b6 = b5 - 4000;
  const uint32_t b6_squared = asr(b6 * b6, 12);
  x1 = asr(b2 * b6_squared, 11);
  x2 = asr(ac2 * b6, 11);
  const uint32_t b3 = asr(((ac1 * 4 + x1 + x2) << oss) + 2, 2);
  x1 = asr(ac3 * b6, 13);
  x2 = asr(b1 * b6_squared, 16);
  const uint32_t b4 = (ac4 * (asr(x1 + x2 + 2, 2) + 32768U)) >> 15;
  if (b4 == 0) {
    return BaroValue();
  }
  const uint32_t b7 = (up - b3) * (50000U >> oss);
  uint32_t p = b7 < 0x80000000U ? b7 * 2 / b4 : b7 / b4 * 2;
  x1 = asr(p, 8);
  x1 = asr(x1 * x1 * 3038, 16);
  x2 = asr(0U - 7357 * p, 16);
  p += asr(x1 + x2 + 3791, 4);
  const int32_t limited =
      temperature_ddegc > 2000 || temperature_ddegc < -2000 ? 2000 : temperature_ddegc;
  return judged(static_cast<int32_t>(p), limited * 10);
}

BaroValue bmp280_compensate(const uint16_t* words, uint32_t adc_t, uint32_t adc_p) {
  const uint32_t t1 = words[0];
  const uint32_t t2 = word(words[1]);
  const uint32_t t3 = word(words[2]);
  const uint32_t p1 = words[3];
  const uint16_t* const p = words + 2;  // p[2] is dig_P2

  const uint32_t half = (adc_t >> 4) - t1;
  const uint32_t fine =
      asr(((adc_t >> 3) - (t1 << 1)) * t2, 11) + asr(asr(half * half, 12) * t3, 14);
  const int32_t temperature_cdegc = static_cast<int32_t>(asr(fine * 5 + 128, 8));

  uint32_t var1 = asr(fine, 1) - 64000U;
  const uint32_t quarter = asr(var1, 2);
  uint32_t var2 = asr(quarter * quarter, 11) * word(p[6]);
  var2 += (var1 * word(p[5])) << 1;
  var2 = asr(var2, 2) + (word(p[4]) << 16);
  var1 = asr(asr(word(p[3]) * asr(quarter * quarter, 13), 3) + asr(word(p[2]) * var1, 1), 18);
  var1 = ((32768U + var1) * p1) >> 15;
  if (var1 == 0) {
    return BaroValue();
  }
  uint32_t pressure = (1048576U - adc_p - asr(var2, 12)) * 3125;
  pressure = pressure < 0x80000000U ? (pressure << 1) / var1 : pressure / var1 * 2;
  const uint32_t eighth = pressure >> 3;
  var1 = asr(word(p[9]) * ((eighth * eighth) >> 13), 12);
  var2 = asr((pressure >> 2) * word(p[8]), 13);
  pressure += asr(var1 + var2 + word(p[7]), 4);
  return judged(static_cast<int32_t>(pressure), temperature_cdegc);
}

}  // namespace core
