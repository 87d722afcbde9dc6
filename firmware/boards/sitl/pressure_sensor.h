// BMP085 at register level: the bus moves bytes, conversions take the datasheet's longest times.
#pragma once

#include <stdint.h>

#include "hal/baro_bus.h"

namespace sitl {

struct Grid;

class PressureSensor {
 public:
  // Coefficients in the order AC1 ... MD, big-endian in the registers as on the chip.
  void configure(bool present, const uint16_t* words);
  void set_present(bool present) { present_ = present; }
  void hold_line(bool held) { held_ = held; }
  void reset_bus();

  void begin_write(uint8_t address, uint8_t reg, uint8_t value);
  void begin_read(uint8_t address, uint8_t reg, uint8_t count);
  // Moves one byte over the bus. `stimulus`: channel 0 UT, channel 1 UP at oversampling 3.
  hal::BusStatus step(int64_t now, const Grid& stimulus);
  const uint8_t* bytes() const { return bytes_; }
  uint32_t conversions() const { return conversions_; }

 private:
  void finish_transfer(int64_t now, const Grid& stimulus);
  uint8_t read_register(uint8_t reg, int64_t now) const;

  bool present_ = false;
  bool held_ = false;
  uint16_t words_[11] = {};
  uint8_t address_ = 0;
  uint8_t reg_ = 0;
  uint8_t value_ = 0;
  uint8_t count_ = 0;
  uint8_t steps_left_ = 0;
  bool reading_ = false;
  hal::BusStatus status_ = hal::BusStatus::kDone;
  uint8_t bytes_[hal::kBaroBusBytes] = {};
  uint32_t result_ = 0;  // as registers F6..F8 show it, 24 bits
  uint32_t old_result_ = 0;
  int64_t ready_at_ = 0;
  uint32_t conversions_ = 0;
};

}  // namespace sitl
