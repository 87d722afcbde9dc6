// BMP085 or BMP280 at register level: the bus moves bytes, conversions take the datasheet's longest
// times.
#pragma once

#include <stdint.h>

#include "hal/baro_bus.h"

namespace sitl {

struct Grid;

class PressureSensor {
 public:
  enum class Chip : uint8_t { kBmp085, kBmp280 };

  // Coefficients in the order AC1 ... MD (11), or dig_T1 ... dig_P9 (12).
  void configure(Chip chip, const uint16_t* words);
  void set_present(bool present) { present_ = present; }
  void hold_line(bool held) { held_ = held; }
  void reset_bus();

  void begin_write(uint8_t address, uint8_t reg, uint8_t value);
  void begin_read(uint8_t address, uint8_t reg, uint8_t count);
  // Moves one byte over the bus. `stimulus`: channel 0 UT, channel 1 UP at oversampling 3; or the
  // 20 bits of temperature and pressure.
  hal::BusStatus step(int64_t now, const Grid& stimulus);
  const uint8_t* bytes() const { return bytes_; }
  uint32_t conversions() const { return conversions_; }

 private:
  void finish_transfer(int64_t now, const Grid& stimulus);
  void convert_085(int64_t now, const Grid& stimulus);
  void convert_280(int64_t now, const Grid& stimulus);
  uint8_t read_register(uint8_t reg, int64_t now) const;

  Chip chip_ = Chip::kBmp085;
  bool present_ = false;
  bool held_ = false;
  uint16_t words_[12] = {};
  uint8_t address_ = 0;
  uint8_t reg_ = 0;
  uint8_t value_ = 0;
  uint8_t count_ = 0;
  uint8_t steps_left_ = 0;
  bool reading_ = false;
  hal::BusStatus status_ = hal::BusStatus::kDone;
  uint8_t bytes_[hal::kBaroBusBytes] = {};
  // As the chip's result registers show it: F6..F8 in the upper 24 bits, or F7..FC in 48.
  uint64_t result_ = 0;
  uint64_t old_result_ = 0;
  int64_t ready_at_ = 0;
  uint32_t conversions_ = 0;
};

}  // namespace sitl
