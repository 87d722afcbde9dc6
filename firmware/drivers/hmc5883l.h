// HMC5883L magnetometer (Honeywell 900405 rev. E) and the QMC5883L (QST 13-52-04 rev. A) sold under
// its name: another address, other registers, little-endian, X Y Z.
#pragma once

#include <stdint.h>

#include "core/bytes.h"

namespace drivers {

enum class MagChip : uint8_t { kNone, kHmc5883l, kQmc5883l };

// 1090 LSB per gauss, axes of the chip in the order x, y, z; -4096 is "no value".
struct MagSample {
  int16_t field[3];
};

constexpr int16_t kMagNone = -4096;

// Bus: bool read(uint8_t address, uint8_t reg, uint8_t* out, uint8_t size),
//      bool write(uint8_t address, uint8_t reg, uint8_t value)
// Both end in time whatever the bus does. One poll is one transfer at most.
template <typename Bus>
class Magnetometer {
 public:
  static constexpr uint8_t kHmcAddress = 0x1E;
  static constexpr uint8_t kQmcAddress = 0x0D;
  static constexpr uint32_t kRetryUs = 1000000;
  static constexpr uint32_t kPeriodUs = 66667;  // 15 Hz
  static constexpr uint8_t kErrors = 3;         // then the chip is looked for again
  static constexpr uint8_t kStuckSamples = 30;  // 2 s; noise is 2 LSB

  explicit Magnetometer(Bus& bus) : bus_(bus) {}

  // True: `out` holds a fresh sample.
  bool poll(uint32_t now_us, MagSample& out) {
    if (now_us - since_us_ < wait_us_) {
      return false;
    }
    since_us_ = now_us;
    if (chip_ == MagChip::kNone) {
      find();
      return false;
    }
    if (step_ < kSetupSteps) {
      set_up();
      return false;
    }
    return take(out);
  }

  MagChip chip() const { return step_ == kSetupSteps ? chip_ : MagChip::kNone; }

 private:
  static constexpr uint8_t kSetupSteps = 3;

  void find() {
    uint8_t id[3] = {};
    step_ = 0;
    errors_ = 0;
    discard_ = 1;  // the first sample still has the gain from before
    wait_us_ = 1000;
    if (look_for_qmc_) {
      look_for_qmc_ = false;
      if (bus_.read(kQmcAddress, 0x0D, id, 1) && id[0] == 0xFF) {
        chip_ = MagChip::kQmc5883l;
        return;
      }
      wait_us_ = kRetryUs;
      return;
    }
    if (bus_.read(kHmcAddress, 0x0A, id, 3) && id[0] == 'H' && id[1] == '4' && id[2] == '3') {
      chip_ = MagChip::kHmc5883l;
      return;
    }
    look_for_qmc_ = true;
  }

  void set_up() {
    // HMC: 8 averages at 15 Hz, +-1.3 gauss, continuous. QMC: set/reset period, 50 Hz at 2 gauss
    // and 512 samples, continuous; the third write (roll over, no interrupt pin) changes nothing.
    struct Write {
      uint8_t reg, value;
    };
    static constexpr Write kHmc0 = {0x00, 0x70}, kHmc1 = {0x01, 0x20}, kHmc2 = {0x02, 0x00};
    static constexpr Write kQmc0 = {0x0B, 0x01}, kQmc1 = {0x0A, 0x01}, kQmc2 = {0x09, 0x05};
    const bool hmc = chip_ == MagChip::kHmc5883l;
    const Write write = step_ == 0   ? (hmc ? kHmc0 : kQmc0)
                        : step_ == 1 ? (hmc ? kHmc1 : kQmc1)
                                     : (hmc ? kHmc2 : kQmc2);
    if (!bus_.write(hmc ? kHmcAddress : kQmcAddress, write.reg, write.value)) {
      lose();
      return;
    }
    ++step_;
    wait_us_ = step_ == kSetupSteps ? kPeriodUs : 1000;
  }

  bool take(MagSample& out) {
    uint8_t bytes[6];
    const bool hmc = chip_ == MagChip::kHmc5883l;
    if (!bus_.read(hmc ? kHmcAddress : kQmcAddress, hmc ? 0x03 : 0x00, bytes, 6)) {
      ++errors_;
      if (errors_ >= kErrors) {
        lose();
      }
      return false;
    }
    errors_ = 0;
    MagSample sample;
    if (!(hmc ? decode_hmc(bytes, sample) : decode_qmc(bytes, sample)) || stuck(sample)) {
      return false;
    }
    if (discard_ != 0) {
      --discard_;
      return false;
    }
    out = sample;
    return true;
  }

  void lose() {
    chip_ = MagChip::kNone;
    step_ = 0;
    wait_us_ = kRetryUs;
  }

  // Section "Data output": X, Z, Y, high byte first; -4096 is an overflow.
  static bool decode_hmc(const uint8_t* bytes, MagSample& out) {
    out.field[0] = static_cast<int16_t>(core::get_be16(bytes));
    out.field[2] = static_cast<int16_t>(core::get_be16(bytes + 2));
    out.field[1] = static_cast<int16_t>(core::get_be16(bytes + 4));
    for (const int16_t value : out.field) {
      if (value < -2048 || value > 2047) {
        return false;
      }
    }
    return true;
  }

  // 12000 LSB per gauss at 2 gauss: 1090 / 12000 = 109 / 1200.
  static bool decode_qmc(const uint8_t* bytes, MagSample& out) {
    for (uint8_t axis = 0; axis < 3; ++axis) {
      const int16_t raw = core::get_le<int16_t>(bytes + 2 * axis);
      if (raw == INT16_MIN || raw == INT16_MAX) {
        return false;
      }
      out.field[axis] = static_cast<int16_t>(int32_t{raw} * 109 / 1200);
    }
    return true;
  }

  bool stuck(const MagSample& sample) {
    bool same = true;
    for (uint8_t axis = 0; axis < 3; ++axis) {
      same = same && sample.field[axis] == last_.field[axis];
    }
    last_ = sample;
    same_ = !same ? uint8_t{0} : same_ < kStuckSamples ? static_cast<uint8_t>(same_ + 1) : same_;
    return same_ >= kStuckSamples;
  }

  Bus& bus_;
  uint32_t since_us_ = 0;
  uint32_t wait_us_ = 0;
  MagSample last_ = {};
  MagChip chip_ = MagChip::kNone;
  bool look_for_qmc_ = false;
  uint8_t step_ = 0;
  uint8_t errors_ = 0;
  uint8_t discard_ = 1;
  uint8_t same_ = 0;
};

}  // namespace drivers
