// MPU-6000 (SPI) and MPU-6050 (I2C): InvenSense RM-MPU-6000A-00 rev. 4.2, PS-MPU-6000A-00 rev. 3.4.
// 500 deg/s, 4 g, 200 Hz on its data-ready line. A burst of 14 bytes is one sampling instant
// (register map, section 4.17); single reads may mix two.
#pragma once

#include <stdint.h>
#include <string.h>

#include "core/bytes.h"
#include "core/imu/sample.h"

namespace drivers {

enum class MpuStatus : uint8_t { kSample, kNotReady, kBusError, kGarbage, kStuck };

// Bus: bool read(uint8_t reg, uint8_t* out, uint8_t size), bool write(uint8_t reg, uint8_t value),
//      bool spi(). The first two return false instead of waiting for a chip that is silent.
// The chip sits with x forward, y left and z up, as on the ArduIMU V3: body axes are x, -y, -z.
template <typename Bus>
class Mpu6000 {
 public:
  static constexpr uint8_t kWhoAmI = 0x68;
  static constexpr uint32_t kResetUs = 100000;  // register map, section 4.28
  static constexpr uint32_t kStartUs = 35000;   // gyro start-up 30 ms, and some
  static constexpr uint32_t kRetryUs = 500000;
  static constexpr uint8_t kStuckSamples = 20;  // noise is 3 LSB: equal bytes mean a dead converter
  static constexpr uint8_t kMaxDlpf = 6;

  // `dlpf` is DLPF_CFG: 2 (98 Hz) for logging at 200 Hz, 3 (42 Hz) at 100 Hz.
  Mpu6000(Bus& bus, uint8_t dlpf) : bus_(bus), dlpf_(dlpf) {}

  // One step of the set-up; true once the chip samples. Never waits.
  bool poll(uint32_t now_us) {
    switch (step_) {
      case Step::kReset:
        if (now_us - since_us_ < wait_us_) {
          return false;
        }
        // From here registers are written at 1 MHz at most; a failed step starts over.
        go(bus_.write(0x6B, 0x80), Step::kWake, kResetUs, now_us);
        return false;
      case Step::kWake:
        if (now_us - since_us_ >= wait_us_) {
          go(identify() && bus_.write(0x6B, 0x01), Step::kSetUp, kStartUs, now_us);
        }
        return false;
      case Step::kSetUp:
        if (now_us - since_us_ >= wait_us_) {
          go(set_up(), Step::kRun, 0, now_us);
        }
        return step_ == Step::kRun;
      case Step::kRun:
        return true;
    }
    return false;
  }

  // After data-ready. Anything but a sample leaves `out` untouched.
  MpuStatus read(core::ImuRawSample& out) {
    if (step_ != Step::kRun) {
      return MpuStatus::kNotReady;
    }
    uint8_t bytes[kBurst];
    if (!bus_.read(0x3B, bytes, kBurst)) {
      return MpuStatus::kBusError;
    }
    if (all_equal(bytes) || !still_set_up()) {
      return MpuStatus::kGarbage;  // a line without a chip reads 0x00 or 0xFF throughout
    }
    same_ = memcmp(bytes, last_, kBurst) == 0 ? static_cast<uint8_t>(same_ + 1) : uint8_t{0};
    memcpy(last_, bytes, kBurst);
    if (same_ >= kStuckSamples) {
      same_ = kStuckSamples;
      return MpuStatus::kStuck;
    }
    decode(bytes, out);
    return MpuStatus::kSample;
  }

  // Starts the set-up again: the chip was silent, stuck or reset by itself.
  void restart(uint32_t now_us) {
    go(false, Step::kReset, 0, now_us);  // a converter that stood still must move first
  }

  bool running() const { return step_ == Step::kRun; }
  uint8_t product_id() const { return product_id_; }
  uint8_t dlpf() const { return dlpf_; }
  void set_dlpf(uint8_t dlpf) { dlpf_ = dlpf; }  // before the set-up

  // Revision C gives 4096 LSB per g where revision D gives 8192 (product ids 0x14, 0x15 of samples,
  // 0x54, 0x55 in production).
  static bool is_revision_c(uint8_t product_id) {
    const uint8_t revision = product_id & 0x0F;
    return (product_id & 0x10) != 0 && (revision == 4 || revision == 5);
  }

 private:
  static constexpr uint8_t kBurst = 14;
  static constexpr int16_t kFullScale = 32760;
  static constexpr uint8_t kRange500 = 0b000'01'000;  // deg/s
  static constexpr uint8_t kRange4g = 0b000'01'000;
  enum class Step : uint8_t { kReset, kWake, kSetUp, kRun };

  void go(bool ok, Step next, uint32_t wait_us, uint32_t now_us) {
    step_ = ok ? next : Step::kReset;
    wait_us_ = ok ? wait_us : kRetryUs;
    since_us_ = now_us;
  }

  bool identify() {
    uint8_t who = 0;
    return bus_.read(0x75, &who, 1) && (who & 0x7E) == kWhoAmI && bus_.read(0x0C, &product_id_, 1);
  }

  bool put(uint8_t reg, uint8_t value) {
    uint8_t back = static_cast<uint8_t>(~value);
    return bus_.write(reg, value) && bus_.read(reg, &back, 1) && back == value;
  }

  bool set_up() {
    return (!bus_.spi() || bus_.write(0x6A, 0x10)) &&  // I2C_IF_DIS
           put(0x19, 4) &&                             // 1 kHz / 5
           put(0x1A, dlpf_) &&                         //
           put(0x1B, kRange500) && put(0x1C, kRange4g) &&
           put(0x37, 0b0001'0000) &&  // 50 us pulses, any read clears the status
           put(0x38, 0b0000'0001);    // data ready
  }

  // Low-pass and ranges as they were written: else the line is disturbed, or the chip has lost them
  // and its counts mean something else. 32 us by SPI at every sample; at every eighth over I2C,
  // where it takes 0.2 ms.
  bool still_set_up() {
    uint8_t back[3];
    if (!bus_.spi() && (turn_++ & 7U) != 0) {
      return true;
    }
    return bus_.read(0x1A, back, sizeof(back)) && back[0] == dlpf_ && back[1] == kRange500 &&
           back[2] == kRange4g;
  }

  static bool all_equal(const uint8_t* bytes) {
    for (uint8_t i = 1; i < kBurst; ++i) {
      if (bytes[i] != bytes[0]) {
        return false;
      }
    }
    return bytes[0] == 0x00 || bytes[0] == 0xFF;
  }

  static int16_t word(const uint8_t* bytes) { return static_cast<int16_t>(core::get_be16(bytes)); }
  static bool at_end(int16_t value) { return value >= kFullScale || value <= -kFullScale; }
  static int16_t minus(int16_t value) {
    return value == INT16_MIN ? INT16_MAX : static_cast<int16_t>(-value);
  }
  static int16_t twice(int16_t value) {
    const int32_t wide = int32_t{value} * 2;
    return static_cast<int16_t>(wide > INT16_MAX    ? INT16_MAX
                                : wide < -INT16_MAX ? -INT16_MAX
                                                    : wide);
  }

  void decode(const uint8_t* bytes, core::ImuRawSample& out) const {
    const bool revision_c = is_revision_c(product_id_);
    out.gyro_saturated = false;
    out.accel_saturated = false;
    for (uint8_t axis = 0; axis < 3; ++axis) {
      const int16_t raw_force = word(bytes + 2 * axis);
      const int16_t rate = word(bytes + 8 + 2 * axis);
      const int16_t force = revision_c ? twice(raw_force) : raw_force;
      out.gyro_saturated = out.gyro_saturated || at_end(rate);
      out.accel_saturated = out.accel_saturated || at_end(force);
      out.rates[axis] = clear_of_none(axis == 0 ? rate : minus(rate));
      out.force[axis] = clear_of_none(axis == 0 ? force : minus(force));
    }
    // raw / 340 + 36.53 degC, in 0.01 degC: 100 / 340 = 5 / 17.
    out.temperature_cdegc = static_cast<int16_t>(int32_t{word(bytes + 6)} * 5 / 17 + 3653);
  }
  // The packet's INT16_MIN means "no value".
  static int16_t clear_of_none(int16_t value) { return value == INT16_MIN ? -INT16_MAX : value; }

  Bus& bus_;
  uint32_t since_us_ = 0;
  uint32_t wait_us_ = 0;
  uint8_t last_[kBurst] = {};
  uint8_t dlpf_;
  uint8_t product_id_ = 0;
  uint8_t same_ = 0;
  uint8_t turn_ = 0;
  Step step_ = Step::kReset;
};

}  // namespace drivers
