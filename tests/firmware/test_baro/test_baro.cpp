// Vectors: BMP085 from the datasheet's example and the debug blocks of two firmwares; BMP280 from
// the example of BST-BMP280-DS001-26, section 3.12.
#include "check.h"
#include "core/baro.h"
#include "core/progmem.h"
#include "random_numbers.h"

namespace {

constexpr uint16_t kWords085[core::kBmp085Words] CORE_FLASH = {
    408, 65464, 51153, 32741, 32757, 23153, 6190, 4, 32768, 56825, 2868};

struct Vector {
  uint32_t ut;
  uint32_t up;
  uint8_t oss;
  int16_t temperature_ddegc;
  uint32_t pressure_pa;
};
constexpr Vector kVectors[] CORE_FLASH = {
    {27898, 23843, 0, 150, 69964},
    {27898, 271097, 3, 150, 99998},
    {24342, 271097, 3, -201, 92251},
    {33315, 271097, 3, 549, 108922},
};

constexpr uint16_t kWords280[core::kBmp280Words] CORE_FLASH = {
    27504, 26435, 64536, 36477, 54851, 3024, 2855, 140, 65529, 15500, 50936, 6000};

void load(uint16_t* words, const uint16_t* from, uint8_t count) {
  core::flash_copy(words, from, static_cast<uint16_t>(2 * count));
}

}  // namespace

TEST_CASE("BMP085: the datasheet's vectors, to the pascal") {
  uint16_t words[core::kBmp085Words];
  load(words, kWords085, core::kBmp085Words);
  for (uint8_t i = 0; i < sizeof(kVectors) / sizeof(kVectors[0]); ++i) {
    const Vector truth = core::flash_load(&kVectors[i]);
    const core::BaroValue value = core::bmp085_compensate(words, truth.oss, truth.ut, truth.up);
    CHECK_EQ(value.temperature, truth.temperature_ddegc * 10);
    CHECK(value.static_pressure == truth.pressure_pa * 16);
  }
}

TEST_CASE("BMP280: the datasheet's example") {
  uint16_t words[core::kBmp280Words];
  load(words, kWords280, core::kBmp280Words);
  const core::BaroValue value = core::bmp280_compensate(words, 519888, 415148);
  CHECK_EQ(value.temperature, 2508);
  // 100653.27 Pa in floating point; its 32-bit integers are good to about a pascal.
  CHECK(value.static_pressure >= 100650U * 16);
  CHECK(value.static_pressure <= 100657U * 16);
}

TEST_CASE("a value outside what the chips measure is none") {
  uint16_t words[core::kBmp085Words];
  load(words, kWords085, core::kBmp085Words);
  const core::BaroValue low = core::bmp085_compensate(words, 0, 27898, 0);
  CHECK(low.static_pressure == 0U);
  CHECK_EQ(low.temperature, INT16_MIN);
  const core::BaroValue hot = core::bmp085_compensate(words, 0, 65535, 23843);
  CHECK(hot.static_pressure == 0U);
}

TEST_CASE("coefficients of a missing or stuck chip are refused") {
  uint16_t words[core::kBmp280Words];
  load(words, kWords085, core::kBmp085Words);
  CHECK(core::bmp085_words_sane(words));
  for (uint8_t i = 0; i < core::kBmp085Words; ++i) {
    const uint16_t right = words[i];
    words[i] = 0;
    CHECK(!core::bmp085_words_sane(words));
    words[i] = 0xFFFF;
    CHECK(!core::bmp085_words_sane(words));
    words[i] = right;
  }
  load(words, kWords280, core::kBmp280Words);
  CHECK(core::bmp280_words_sane(words));
  words[8] = 0xFFFF;  // P6 may be anything: it is -7 in the example
  CHECK(core::bmp280_words_sane(words));
  words[3] = 0;
  CHECK(!core::bmp280_words_sane(words));
  for (uint16_t& word : words) {
    word = 0x1234;
  }
  CHECK(!core::bmp280_words_sane(words));
}

TEST_CASE("random coefficients and readings: a plausible value or none, no trap") {
  uint32_t random = 7;
  uint16_t plausible = 0;
  uint16_t wrong = 0;
  for (uint16_t round = 0; round < 2000; ++round) {
    uint16_t words[core::kBmp280Words];
    for (uint16_t& word : words) {
      next_random(random);
      word = static_cast<uint16_t>(random >> 16);
    }
    next_random(random);
    const uint32_t a = random >> 12;
    next_random(random);
    const uint32_t b = random >> 12;
    const core::BaroValue values[] = {
        core::bmp085_compensate(words, static_cast<uint8_t>(round % 4), a & 0xFFFF, b),
        core::bmp280_compensate(words, a, b)};
    for (const core::BaroValue& value : values) {
      if (value.static_pressure == 0) {
        wrong = static_cast<uint16_t>(wrong + (value.temperature != INT16_MIN));
        continue;
      }
      ++plausible;
      wrong = static_cast<uint16_t>(
          wrong + (value.static_pressure < 20000U * 16 || value.static_pressure > 120000U * 16 ||
                   value.temperature < -5000 || value.temperature > 10000));
    }
  }
  CHECK_EQ(wrong, 0);
  CHECK(plausible > 0);
}
