// BMP280 pressure sensor: Bosch BST-BMP280-DS001-26, sections 3.3, 3.8, 3.11 and 4.
#pragma once

#include <stdint.h>

#include "core/baro.h"
#include "core/bytes.h"
#include "drivers/bmp085.h"
#include "generated/frames.h"

namespace drivers {

struct Bmp280 {
  static constexpr uint8_t kChipId = 0x58;
  static constexpr frames::BaroSensor kSensor = frames::BaroSensor::kBmp280;
  static constexpr uint8_t kWordsRegister = 0x88;
  static constexpr uint8_t kWordsSize = 2 * core::kBmp280Words;
  static constexpr uint8_t kOversampling = 3;  // osrs_p: 4 conversions
  static constexpr uint8_t kPhases = 1;

  // Forced mode, temperature once, pressure 4 times: table 13 gives at most 13.3 ms.
  static BaroPhase phase(uint8_t) {
    static constexpr BaroPhase kPhase CORE_FLASH = {
        0b001'00'001 | kOversampling << 2, 14500, 0xF7, 6};
    return core::flash_load(&kPhase);
  }
  // Section 3.8.1, typical: start 1 ms, temperature 2 ms, half of 0.5 + 4 * 2 ms pressure.
  static constexpr uint16_t kMiddleUs = 7250;

  static void words(const uint8_t* bytes, uint16_t* words) { memcpy(words, bytes, kWordsSize); }
  static bool sane(const uint16_t* words) { return core::bmp280_words_sane(words); }

  // Section 3.12: 20 bits each, left-aligned in three bytes.
  static void take(uint8_t, const uint8_t* bytes, uint32_t& pressure, uint32_t& temperature) {
    pressure = core::get_be24(bytes) >> 4;
    temperature = core::get_be24(bytes + 3) >> 4;
  }
  static core::BaroValue compensate(const uint16_t* words,
                                    uint32_t pressure,
                                    uint32_t temperature) {
    return core::bmp280_compensate(words, temperature, pressure);
  }
};

}  // namespace drivers
