#include "boards/sitl/pressure_sensor.h"

#include <string.h>

#include "boards/sitl/world.h"

namespace sitl {

using hal::BusStatus;

namespace {

constexpr uint8_t kAddress = 0x77;
constexpr uint8_t kChipId = 0x55;

// Longest conversion by oversampling (BST-BMP085-DS000-05, table 3).
constexpr Tick kTemperatureTicks = 4500 * kTicksPerUs;
constexpr Tick kPressureTicks[4] = {
    4500 * kTicksPerUs, 7500 * kTicksPerUs, 13500 * kTicksPerUs, 25500 * kTicksPerUs};

}  // namespace

void PressureSensor::configure(bool present, const uint16_t* words) {
  present_ = present;
  memcpy(words_, words, sizeof words_);
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
  } else if (!present_ || address_ != kAddress) {
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
  const bool temperature = value_ == 0x2E;
  const uint8_t oversampling = static_cast<uint8_t>(value_ >> 6);
  const Tick duration = temperature ? kTemperatureTicks : kPressureTicks[oversampling];
  old_result_ = read_register(0xF6, now) * 65536U + read_register(0xF7, now) * 256U +
                read_register(0xF8, now);
  // The converter averages; its mean instant is the middle.
  const double raw = stimulus.at(now + duration / 2, temperature ? 0 : 1);
  const uint32_t count = raw < 0 ? 0U : static_cast<uint32_t>(raw);
  result_ = temperature ? count << 8 : (count >> (3U - oversampling)) << (8U - oversampling);
  ready_at_ = now + duration;
  ++conversions_;
}

uint8_t PressureSensor::read_register(uint8_t reg, int64_t now) const {
  if (reg >= 0xAA && reg <= 0xBF) {
    const uint16_t word = words_[(reg - 0xAA) / 2];
    return static_cast<uint8_t>(reg % 2 == 0 ? word >> 8 : word);
  }
  if (reg == 0xD0) return kChipId;
  const uint32_t result = now >= ready_at_ ? result_ : old_result_;
  if (reg == 0xF6) return static_cast<uint8_t>(result >> 16);
  if (reg == 0xF7) return static_cast<uint8_t>(result >> 8);
  if (reg == 0xF8) return static_cast<uint8_t>(result);
  return 0;
}

}  // namespace sitl
