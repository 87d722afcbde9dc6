// Whichever pressure sensor answers: finds it by its chip id (register 0xD0 of both), reads its
// coefficients, measures. Never waits: one bus transaction or one timer at a time.
#pragma once

#include <stdint.h>

#include "core/baro.h"
#include "drivers/bmp085.h"
#include "drivers/bmp280.h"
#include "drivers/soft_i2c.h"
#include "generated/frames.h"

namespace drivers {

// Argument of the event `baro_lost`.
enum class BaroStatus : uint8_t {
  kOk = 0,
  kSilent = 1,       // nobody acknowledges
  kStuck = 2,        // a line is held low
  kOtherChip = 3,    // a chip id that is not known
  kCoefficients = 4  // coefficients that no chip has: raw values go on
};

enum class BaroEvent : uint8_t { kNone, kFound, kLost, kValue };

// Bus: bool start(uint8_t address, uint8_t* buffer, uint8_t out, uint8_t in, uint32_t now_us)
//      BusStatus poll(uint32_t now_us)
template <typename Bus>
class Barometer {
 public:
  static constexpr uint32_t kRetryUs = 1000000UL;

  explicit Barometer(Bus& bus) : bus_(bus) {}

  // Asks for one measurement; ignored while one is on or no sensor is there.
  void measure() { wanted_ = true; }

  BaroEvent poll(uint32_t now_us) {
    switch (step_) {
      case Step::kRetry:
        if (now_us - since_us_ < kRetryUs && tried_) {
          return BaroEvent::kNone;
        }
        tried_ = true;
        address_ ^= 0x77 ^ 0x76;  // the BMP280 may sit at either
        wanted_ = false;
        read(kIdRegister, 1, now_us);
        step_ = Step::kId;
        return BaroEvent::kNone;
      case Step::kRest:
        if (!sane_ && now_us - words_us_ >= kRetryUs) {
          read_words(now_us);
          return BaroEvent::kNone;
        }
        if (wanted_) {
          wanted_ = false;
          phase_ = 0;
          command(now_us);
        }
        return BaroEvent::kNone;
      case Step::kConverting:
        if (now_us - since_us_ >= wait_us_) {
          read(phase().read_register, phase().size, now_us);
          step_ = Step::kData;
        }
        return BaroEvent::kNone;
      case Step::kId:
      case Step::kWords:
      case Step::kCommand:
      case Step::kData:
        break;
    }
    switch (bus_.poll(now_us)) {
      case BusStatus::kIdle:
      case BusStatus::kBusy:
        return BaroEvent::kNone;
      case BusStatus::kNack:
        return lose(BaroStatus::kSilent, now_us);
      case BusStatus::kStuck:
        return lose(BaroStatus::kStuck, now_us);
      case BusStatus::kDone:
        break;
    }
    return done(now_us);
  }

  bool present() const { return sensor_ != frames::BaroSensor::kNone; }
  BaroStatus status() const { return status_; }
  uint8_t chip_id() const { return is_280() ? Bmp280::kChipId : Bmp085::kChipId; }
  uint16_t errors() const { return errors_; }
  const frames::BaroFrame& frame() const { return frame_; }

  // t_us is left to the caller.
  void coefficients(frames::BaroCoefficientsFrame& out) const {
    out.sensor = static_cast<uint8_t>(sensor_);
    out.oversampling = is_280() ? Bmp280::kOversampling : Bmp085::kOversampling;
    memcpy(out.words, words_, sizeof(words_));
  }

 private:
  enum class Step : uint8_t { kRetry, kId, kWords, kRest, kCommand, kConverting, kData };

  static constexpr uint8_t kIdRegister = 0xD0;
  static constexpr uint8_t kControlRegister = 0xF4;

  bool is_280() const { return sensor_ == frames::BaroSensor::kBmp280; }
  BaroPhase phase() const { return is_280() ? Bmp280::phase(phase_) : Bmp085::phase(phase_); }

  void read(uint8_t from_register, uint8_t size, uint32_t now_us) {
    buffer_[0] = from_register;
    bus_.start(address_, buffer_, 1, size, now_us);
  }

  void command(uint32_t now_us) {
    buffer_[0] = kControlRegister;
    buffer_[1] = phase().control;
    bus_.start(address_, buffer_, 2, 0, now_us);
    step_ = Step::kCommand;
  }

  BaroEvent lose(BaroStatus why, uint32_t now_us) {
    const bool was_there = step_ > Step::kWords;
    status_ = why;
    if (errors_ != 0xFFFF) {
      ++errors_;
    }
    sensor_ = frames::BaroSensor::kNone;
    step_ = Step::kRetry;
    since_us_ = now_us;
    return was_there ? BaroEvent::kLost : BaroEvent::kNone;
  }

  BaroEvent done(uint32_t now_us) {
    switch (step_) {
      case Step::kId:
        if (buffer_[0] != Bmp085::kChipId && buffer_[0] != Bmp280::kChipId) {
          return lose(BaroStatus::kOtherChip, now_us);
        }
        sensor_ = buffer_[0] == Bmp280::kChipId ? Bmp280::kSensor : Bmp085::kSensor;
        read_words(now_us);
        return BaroEvent::kNone;
      case Step::kWords:
        if (is_280()) {
          Bmp280::words(buffer_, words_);
        } else {
          Bmp085::words(buffer_, words_);
        }
        return judge_words(now_us);
      case Step::kCommand:
        since_us_ = now_us;
        wait_us_ = phase().wait_us;
        step_ = Step::kConverting;
        return BaroEvent::kNone;
      case Step::kData:
        return take();
      case Step::kRetry:
      case Step::kRest:
      case Step::kConverting:
        break;
    }
    return BaroEvent::kNone;
  }

  void read_words(uint32_t now_us) {
    read(is_280() ? Bmp280::kWordsRegister : Bmp085::kWordsRegister,
         is_280() ? Bmp280::kWordsSize : Bmp085::kWordsSize,
         now_us);
    step_ = Step::kWords;
  }

  // Measures even with coefficients that no chip has: the raw values may be good. Reads them again
  // every second, and tells of it once.
  BaroEvent judge_words(uint32_t now_us) {
    const bool told = status_ == BaroStatus::kCoefficients;
    sane_ = is_280() ? Bmp280::sane(words_) : Bmp085::sane(words_);
    step_ = Step::kRest;
    words_us_ = now_us;
    if (sane_) {
      status_ = BaroStatus::kOk;
      return BaroEvent::kFound;
    }
    status_ = BaroStatus::kCoefficients;
    if (errors_ != 0xFFFF) {
      ++errors_;
    }
    return told ? BaroEvent::kNone : BaroEvent::kLost;
  }

  BaroEvent take() {
    uint32_t pressure = frame_.raw_pressure;
    uint32_t temperature = frame_.raw_temperature;
    if (is_280()) {
      Bmp280::take(phase_, buffer_, pressure, temperature);
    } else {
      Bmp085::take(phase_, buffer_, pressure, temperature);
    }
    frame_.raw_pressure = pressure;
    frame_.raw_temperature = temperature;
    ++phase_;
    if (phase_ < (is_280() ? Bmp280::kPhases : Bmp085::kPhases)) {
      command(since_us_);
      return BaroEvent::kNone;
    }
    core::BaroValue value;
    if (sane_) {
      value = is_280() ? Bmp280::compensate(words_, pressure, temperature)
                       : Bmp085::compensate(words_, pressure, temperature);
    }
    frame_.t_us = since_us_ + (is_280() ? Bmp280::kMiddleUs : Bmp085::kMiddleUs);
    frame_.static_pressure = value.static_pressure;
    frame_.temperature = value.temperature;
    frame_.sensor = static_cast<uint8_t>(sensor_);
    step_ = Step::kRest;
    return BaroEvent::kValue;
  }

  Bus& bus_;
  uint32_t since_us_ = 0;  // the last command was acknowledged, or the sensor was lost
  uint32_t words_us_ = 0;  // the coefficients were read
  frames::BaroFrame frame_ = {};
  uint16_t words_[12] = {};
  uint16_t wait_us_ = 0;  // of the conversion under way
  uint16_t errors_ = 0;
  uint8_t buffer_[24] = {};
  uint8_t address_ = 0x76;
  uint8_t phase_ = 0;
  Step step_ = Step::kRetry;
  BaroStatus status_ = BaroStatus::kSilent;
  frames::BaroSensor sensor_ = frames::BaroSensor::kNone;
  bool wanted_ = false;
  bool sane_ = true;
  bool tried_ = false;
};

}  // namespace drivers
