#include "boards/sitl/pressure_sensor.h"

#include <string.h>

#include "boards/sitl/world.h"

namespace sitl {

using hal::BusStatus;

namespace {

constexpr uint8_t kAddress085 = 0x77;
constexpr uint8_t kAddress280 = 0x76;

// Longest conversion by oversampling (BST-BMP085-DS000-05, table 3).
constexpr Tick kTemperatureTicks = 4500 * kTicksPerUs;
constexpr Tick kPressureTicks[4] = {
    4500 * kTicksPerUs, 7500 * kTicksPerUs, 13500 * kTicksPerUs, 25500 * kTicksPerUs};

// One temperature, four pressures (BST-BMP280-DS001-26, section 3.8.1: longest, and the typical
// middle of the pressures).
constexpr Tick kForcedTicks = 13325 * kTicksPerUs;
constexpr Tick kForcedMiddleTicks = 7250 * kTicksPerUs;

uint32_t count_of(double raw) {
  return raw < 0 ? 0U : static_cast<uint32_t>(raw);
}

}  // namespace

void PressureSensor::configure(Chip chip, const uint16_t* words) {
  chip_ = chip;
  present_ = true;
  memcpy(words_, words, (chip == Chip::kBmp085 ? 11 : 12) * sizeof words_[0]);
}

void PressureSensor::reset_bus() {
  steps_left_ = 0;
  status_ = BusStatus::kDone;
}

void PressureSensor::begin_write(uint8_t address, uint8_t reg, uint8_t value) {
  address_ = address;
  reg_ = reg;
  value_ = value;
  reading_ = false;
  steps_left_ = 3;
  status_ = BusStatus::kBusy;
}

void PressureSensor::begin_read(uint8_t address, uint8_t reg, uint8_t count) {
  address_ = address;
  reg_ = reg;
  count_ = count;
  reading_ = true;
  steps_left_ = static_cast<uint8_t>(3 + count);
  status_ = BusStatus::kBusy;
}

BusStatus PressureSensor::step(int64_t now, const Grid& stimulus) {
  if (status_ != BusStatus::kBusy) return status_;
  if (held_) {
    status_ = BusStatus::kStuck;
  } else if (!present_ || address_ != (chip_ == Chip::kBmp085 ? kAddress085 : kAddress280)) {
    status_ = BusStatus::kNoAck;
  } else if (--steps_left_ == 0) {
    finish_transfer(now, stimulus);
    status_ = BusStatus::kDone;
  }
  return status_;
}

void PressureSensor::finish_transfer(int64_t now, const Grid& stimulus) {
  if (reading_) {
    for (uint8_t i = 0; i < count_ && i < sizeof bytes_; ++i) {
      bytes_[i] = read_register(static_cast<uint8_t>(reg_ + i), now);
    }
    return;
  }
  if (reg_ != 0xF4) return;
  if (chip_ == Chip::kBmp085) {
    convert_085(now, stimulus);
  } else if ((value_ & 0b11) == 0b01 || (value_ & 0b11) == 0b10) {
    convert_280(now, stimulus);
  }
}

void PressureSensor::convert_085(int64_t now, const Grid& stimulus) {
  const bool temperature = value_ == 0x2E;
  const uint8_t oversampling = static_cast<uint8_t>(value_ >> 6);
  const Tick duration = temperature ? kTemperatureTicks : kPressureTicks[oversampling];
  old_result_ = now >= ready_at_ ? result_ : old_result_;
  // The converter averages; its mean instant is the middle.
  const uint32_t count = count_of(stimulus.at(now + duration / 2, temperature ? 0 : 1));
  result_ = temperature ? count << 8 : (count >> (3U - oversampling)) << (8U - oversampling);
  ready_at_ = now + duration;
  ++conversions_;
}

void PressureSensor::convert_280(int64_t now, const Grid& stimulus) {
  old_result_ = now >= ready_at_ ? result_ : old_result_;
  const uint64_t pressure = count_of(stimulus.at(now + kForcedMiddleTicks, 1)) & 0xFFFFFU;
  const uint64_t temperature = count_of(stimulus.at(now + kForcedMiddleTicks, 0)) & 0xFFFFFU;
  result_ = pressure << 28 | temperature << 4;
  ready_at_ = now + kForcedTicks;
  ++conversions_;
}

uint8_t PressureSensor::read_register(uint8_t reg, int64_t now) const {
  const uint64_t result = now >= ready_at_ ? result_ : old_result_;
  if (chip_ == Chip::kBmp280) {
    if (reg >= 0x88 && reg <= 0x9F) {
      const uint16_t word = words_[(reg - 0x88) / 2];
      return static_cast<uint8_t>(reg % 2 == 0 ? word : word >> 8);
    }
    if (reg == 0xD0) return 0x58;
    if (reg >= 0xF7 && reg <= 0xFC) return static_cast<uint8_t>(result >> (8 * (0xFC - reg)));
    return 0;
  }
  if (reg >= 0xAA && reg <= 0xBF) {
    const uint16_t word = words_[(reg - 0xAA) / 2];
    return static_cast<uint8_t>(reg % 2 == 0 ? word >> 8 : word);
  }
  if (reg == 0xD0) return 0x55;
  if (reg >= 0xF6 && reg <= 0xF8) return static_cast<uint8_t>(result >> (8 * (0xF8 - reg)));
  return 0;
}

}  // namespace sitl
