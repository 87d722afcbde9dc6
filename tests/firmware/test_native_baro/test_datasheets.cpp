// Both data sheets' integer formulas once more in 64 bits, where nothing wraps, against random
// plausible chips; and the limits of what is believed.
#include "check.h"
#include "core/baro.h"
#include "random_numbers.h"

namespace {

struct Truth {
  int64_t pressure_pa;
  int64_t temperature_cdegc;

  bool plausible() const {
    return pressure_pa >= 20000 && pressure_pa <= 120000 && temperature_cdegc >= -5000 &&
           temperature_cdegc <= 10000;
  }
};

int64_t floored(int64_t value, uint8_t bits) {
  return value >> bits;
}

// BST-BMP085-DS000, section 3.5: division cuts towards zero, shifts go down.
Truth bmp085(const uint16_t* w, uint8_t oss, int64_t ut, int64_t up) {
  const int64_t ac1 = static_cast<int16_t>(w[0]);
  const int64_t ac2 = static_cast<int16_t>(w[1]);
  const int64_t ac3 = static_cast<int16_t>(w[2]);
  const int64_t b1 = static_cast<int16_t>(w[6]);
  const int64_t b2 = static_cast<int16_t>(w[7]);
  const int64_t mc = static_cast<int16_t>(w[9]);
  const int64_t md = static_cast<int16_t>(w[10]);
  const int64_t of_temperature = floored((ut - w[5]) * w[4], 15);
  const int64_t b5 = of_temperature + mc * 2048 / (of_temperature + md);
  const int64_t b6 = b5 - 4000;
  const int64_t square = floored(b6 * b6, 12);
  const int64_t x3 = floored(b2 * square, 11) + floored(ac2 * b6, 11);
  const int64_t b3 = floored(((ac1 * 4 + x3) * (int64_t{1} << oss)) + 2, 2);
  const int64_t y3 = floored(floored(ac3 * b6, 13) + floored(b1 * square, 16) + 2, 2);
  const int64_t b4 = floored(int64_t{w[3]} * (y3 + 32768), 15);
  const int64_t b7 = (up - b3) * (50000 >> oss);
  int64_t p = b7 < INT64_C(0x80000000) ? b7 * 2 / b4 : b7 / b4 * 2;
  const int64_t of_p = floored(floored(p, 8) * floored(p, 8) * 3038, 16);
  p += floored(of_p + floored(-7357 * p, 16) + 3791, 4);
  return {p, floored(b5 + 8, 4) * 10};
}

// BST-BMP280-DS001, section 8.2.
Truth bmp280(const uint16_t* w, int64_t adc_t, int64_t adc_p) {
  const auto word = [w](uint8_t of) { return int64_t{static_cast<int16_t>(w[of])}; };
  const int64_t half = floored(adc_t, 4) - w[0];
  const int64_t fine = floored((floored(adc_t, 3) - 2 * int64_t{w[0]}) * word(1), 11) +
                       floored(floored(half * half, 12) * word(2), 14);
  const int64_t v = floored(fine, 1) - 64000;
  const int64_t square = floored(v, 2) * floored(v, 2);
  int64_t offset = floored(square, 11) * word(8) + v * word(7) * 2;
  offset = floored(offset, 2) + word(6) * 65536;
  int64_t gain = floored(floored(word(5) * floored(square, 13), 3) + floored(word(4) * v, 1), 18);
  gain = floored((32768 + gain) * w[3], 15);
  int64_t p = (1048576 - adc_p - floored(offset, 12)) * 3125;
  p = p < INT64_C(0x80000000) ? p * 2 / gain : p / gain * 2;
  const int64_t high = floored(word(11) * floored(floored(p, 3) * floored(p, 3), 13), 12);
  const int64_t low = floored(floored(p, 2) * word(10), 13);
  p += floored(high + low + word(9), 4);
  return {p, floored(fine * 5 + 128, 8)};
}

bool agrees(const core::BaroValue& value, const Truth& truth) {
  if (!truth.plausible()) {
    return value.static_pressure == 0 && value.temperature == INT16_MIN;
  }
  return value.static_pressure == static_cast<uint32_t>(truth.pressure_pa * 16) &&
         value.temperature == truth.temperature_cdegc;
}

constexpr uint16_t kExample085[core::kBmp085Words] = {
    408, 65464, 51153, 32741, 32757, 23153, 6190, 4, 32768, 56825, 2868};
constexpr uint16_t kExample280[core::kBmp280Words] = {
    27504, 26435, 64536, 36477, 54851, 3024, 2855, 140, 65529, 15500, 50936, 6000};

// A word of the example, altered by up to a sixteenth of the range.
void draw(Random& random, uint16_t* words, const uint16_t* from, uint8_t count) {
  for (uint8_t i = 0; i < count; ++i) {
    const int32_t other = static_cast<int16_t>(from[i]) + (random.below(4096) - 2048) / 4;
    words[i] = static_cast<uint16_t>(other);
  }
}

}  // namespace

TEST_CASE("BMP085: random chips, temperatures and pressures, to the bit") {
  Random random(85);
  uint16_t plausible = 0;
  uint16_t high = 0;
  for (uint16_t round = 0; round < 3000; ++round) {
    uint16_t words[core::kBmp085Words];
    draw(random, words, kExample085, core::kBmp085Words);
    words[3] = static_cast<uint16_t>(26000U + random.below(39000));
    const uint8_t oss = static_cast<uint8_t>(round % 4);
    const uint32_t ut = 21000U + random.below(16000);
    const uint32_t up = (8000U + random.below(56000)) << oss;
    const Truth truth = bmp085(words, oss, ut, up);
    CHECK(agrees(core::bmp085_compensate(words, oss, ut, up), truth));
    plausible = static_cast<uint16_t>(plausible + truth.plausible());
    high = static_cast<uint16_t>(high + (truth.plausible() && up >> oss > 52000U));
  }
  CHECK(plausible > 900);
  CHECK(high > 30);  // where 32 bits hold no double of it
}

TEST_CASE("BMP280: random chips, temperatures and pressures, to the bit") {
  Random random(280);
  uint16_t plausible = 0;
  uint16_t high = 0;
  for (uint16_t round = 0; round < 3000; ++round) {
    uint16_t words[core::kBmp280Words];
    draw(random, words, kExample280, core::kBmp280Words);
    words[3] = static_cast<uint16_t>(30000U + random.below(35000));
    words[8] = static_cast<uint16_t>(random.below(800) - 400);  // P6: -7 hides its shift
    const uint32_t adc_t = 360000U + 6U * random.below(60000);
    const uint32_t adc_p = 130000U + 8U * random.below(60000);
    const Truth truth = bmp280(words, adc_t, adc_p);
    CHECK(agrees(core::bmp280_compensate(words, adc_t, adc_p), truth));
    plausible = static_cast<uint16_t>(plausible + truth.plausible());
    high = static_cast<uint16_t>(high + (truth.plausible() && adc_p < 300000U));
  }
  CHECK(plausible > 900);
  CHECK(high > 30);
}

TEST_CASE("each pascal and each step of temperature around the limits of both chips") {
  uint16_t words[core::kBmp280Words];
  for (uint8_t i = 0; i < core::kBmp085Words; ++i) {
    words[i] = kExample085[i];
  }
  bool seen[4] = {};
  for (uint32_t up = 30000; up < 500000; ++up) {
    const Truth truth = bmp085(words, 3, 27898, up);
    const int64_t p = truth.pressure_pa;
    if (p < 19995 || (p > 20005 && p < 119995) || p > 120005) {
      up += p < 19500 || (p > 20500 && p < 119500) ? 50 : 0;
      continue;
    }
    seen[0] = seen[0] || p == 19999;
    seen[1] = seen[1] || p == 20000;
    seen[2] = seen[2] || p == 120000;
    seen[3] = seen[3] || p == 120001;
    CHECK(agrees(core::bmp085_compensate(words, 3, 27898, up), truth));
  }
  CHECK(seen[0]);
  CHECK(seen[1]);
  CHECK(seen[2]);
  CHECK(seen[3]);
  for (uint32_t ut = 21000; ut < 45000; ++ut) {
    CHECK(agrees(core::bmp085_compensate(words, 3, ut, 271097), bmp085(words, 3, ut, 271097)));
  }
  for (uint8_t i = 0; i < core::kBmp280Words; ++i) {
    words[i] = kExample280[i];
  }
  for (uint32_t adc_t = 260000; adc_t < 800000; adc_t += 20) {
    const Truth truth = bmp280(words, adc_t, 415148);
    // Behind -47.4 and 97.4 degC the data sheet's square needs more than its 32 bits.
    if (truth.temperature_cdegc > -4740 && truth.temperature_cdegc < 9740) {
      CHECK(agrees(core::bmp280_compensate(words, adc_t, 415148), truth));
    }
  }
  const struct {
    uint32_t from;
    int32_t limit_cdegc;
  } edges[] = {{260000, -5000}, {700000, 10000}};
  for (const auto& edge : edges) {  // every value that rounds to the limit or its neighbours
    for (uint32_t adc_t = edge.from; adc_t < edge.from + 80000; ++adc_t) {
      const Truth truth = bmp280(words, adc_t, 415148);
      if (truth.temperature_cdegc >= edge.limit_cdegc - 1 &&
          truth.temperature_cdegc <= edge.limit_cdegc + 1) {
        const bool is_some = core::bmp280_compensate(words, adc_t, 415148).static_pressure != 0;
        CHECK_EQ(is_some, truth.plausible());
      }
    }
  }
}

TEST_CASE(
    "where the formula would divide by nothing there is no value; where it does not there is") {
  uint16_t words[core::kBmp280Words];
  for (uint8_t i = 0; i < core::kBmp085Words; ++i) {
    words[i] = kExample085[i];
  }
  // X1 of zero is a temperature like others.
  const Truth truth = bmp085(words, 0, words[5], 23843);
  CHECK(truth.plausible());
  CHECK(agrees(core::bmp085_compensate(words, 0, words[5], 23843), truth));
  words[10] = 0;
  CHECK(core::bmp085_compensate(words, 0, words[5], 23843).static_pressure == 0U);
  words[10] = 2868;
  words[3] = 0;
  CHECK(core::bmp085_compensate(words, 0, 27898, 23843).static_pressure == 0U);
  for (uint8_t i = 0; i < core::kBmp280Words; ++i) {
    words[i] = kExample280[i];
  }
  words[3] = 0;
  CHECK(core::bmp280_compensate(words, 519888, 415148).static_pressure == 0U);
}

TEST_CASE("BMP280: T1 and P1 are neither 0 nor 0xFFFF, and not all words are alike") {
  uint16_t words[core::kBmp280Words];
  for (uint8_t odd = 0; odd < core::kBmp280Words; ++odd) {
    for (uint16_t& word : words) {
      word = 77;
    }
    CHECK(!core::bmp280_words_sane(words));
    words[odd] = 78;
    CHECK(core::bmp280_words_sane(words));
  }
  for (uint8_t i = 0; i < core::kBmp280Words; ++i) {
    words[i] = kExample280[i];
  }
  for (uint8_t which = 0; which < core::kBmp280Words; ++which) {
    const bool counts = which == 0 || which == 3;
    const uint16_t right = words[which];
    words[which] = 0;
    CHECK_EQ(core::bmp280_words_sane(words), !counts);
    words[which] = 0xFFFF;
    CHECK_EQ(core::bmp280_words_sane(words), !counts);
    words[which] = 1;
    CHECK(core::bmp280_words_sane(words));
    words[which] = 0xFFFE;
    CHECK(core::bmp280_words_sane(words));
    words[which] = right;
  }
}
