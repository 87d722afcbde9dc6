// BMP085 pressure sensor: Bosch BST-BMP085-DS000-05, sections 3.3 and 3.4. BMP180 reads alike.
#pragma once

#include <stdint.h>

#include "core/baro.h"
#include "core/bytes.h"
#include "core/progmem.h"
#include "generated/frames.h"

namespace drivers {

// What `Barometer` does to measure: write `control` to 0xF4, wait, read `size` bytes.
struct BaroPhase {
  uint8_t control;
  uint16_t wait_us;
  uint8_t read_register;
  uint8_t size;
};

struct Bmp085 {
  static constexpr uint8_t kChipId = 0x55;
  static constexpr frames::BaroSensor kSensor = frames::BaroSensor::kBmp085;
  static constexpr uint8_t kWordsRegister = 0xAA;
  static constexpr uint8_t kWordsSize = 2 * core::kBmp085Words;
  static constexpr uint8_t kOversampling = 2;  // high resolution: 5 Pa rms, 13.5 ms
  static constexpr uint8_t kPhases = 2;

  // Table 8: 4.5 ms for a temperature, 13.5 ms for a pressure at oss 2; a tenth is added.
  static BaroPhase phase(uint8_t index) {
    static constexpr BaroPhase kPhase[kPhases] CORE_FLASH = {
        {0x2E, 4950, 0xF6, 2}, {0x34 | kOversampling << 6, 14850, 0xF6, 3}};
    return core::flash_load(&kPhase[index]);
  }
  // From the command to the middle of the pressure conversion.
  static constexpr uint16_t kMiddleUs = 6750;

  static void words(const uint8_t* bytes, uint16_t* words) {
    for (uint8_t i = 0; i < core::kBmp085Words; ++i) {
      words[i] = core::get_be16(bytes + 2 * i);
    }
    words[11] = 0;
  }
  static bool sane(const uint16_t* words) { return core::bmp085_words_sane(words); }

  static void take(uint8_t phase_index,
                   const uint8_t* bytes,
                   uint32_t& pressure,
                   uint32_t& temperature) {
    if (phase_index == 0) {
      temperature = core::get_be16(bytes);
    } else {
      pressure = core::get_be24(bytes) >> (8 - kOversampling);
    }
  }
  static core::BaroValue compensate(const uint16_t* words,
                                    uint32_t pressure,
                                    uint32_t temperature) {
    return core::bmp085_compensate(words, kOversampling, temperature, pressure);
  }
};

}  // namespace drivers
