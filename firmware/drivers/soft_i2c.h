// I2C master on two open-drain lines: NXP UM10204 rev. 6, sections 3.1 and 3.1.16. Never waits.
#pragma once

#include <stdint.h>

namespace drivers {

enum class BusStatus : uint8_t { kIdle, kBusy, kDone, kNack, kStuck };

// Pins: void sda(bool released), void scl(bool released), bool sda(), bool scl()
//       void half_bit()   at least 1.3 us for 400 kHz
// A poll moves one byte with the START or STOP beside it, about 60 us. A line held low for 2 ms
// ends the transaction as kStuck after nine clocks and a STOP.
template <typename Pins>
class SoftI2c {
 public:
  static constexpr uint16_t kStuckUs = 2000;

  explicit SoftI2c(Pins& pins) : pins_(pins) {}

  // Writes `out`, one byte at least, then, if `in_size` is not 0, reads behind a repeated START.
  // The buffer is used for both and must live until the end.
  bool start(uint8_t address, uint8_t* buffer, uint8_t out_size, uint8_t in_size, uint32_t now_us) {
    if (status_ == BusStatus::kBusy) {
      return false;
    }
    address_ = address;
    buffer_ = buffer;
    out_size_ = out_size;
    in_size_ = in_size;
    at_ = 0;
    phase_ = Phase::kStart;
    moved_us_ = now_us;
    status_ = BusStatus::kBusy;
    return true;
  }

  BusStatus poll(uint32_t now_us) {
    if (status_ != BusStatus::kBusy) {
      return status_;
    }
    // The lines are looked at between bytes only; inside a byte this chip never stretches.
    if (!pins_.scl() || (phase_ == Phase::kStart && !pins_.sda())) {
      if (now_us - moved_us_ > kStuckUs) {
        recover();
        status_ = BusStatus::kStuck;
      }
      return status_;
    }
    moved_us_ = now_us;
    move();
    return status_;
  }

 private:
  enum class Phase : uint8_t { kStart, kWrite, kRestart, kRead };

  void move() {
    switch (phase_) {
      case Phase::kStart:
        begin();
        acknowledged(write_byte(static_cast<uint8_t>(address_ << 1)));
        phase_ = Phase::kWrite;
        return;
      case Phase::kWrite:
        if (!acknowledged(write_byte(buffer_[at_++])) || at_ < out_size_) {
          return;
        }
        if (in_size_ == 0) {
          end(BusStatus::kDone);
          return;
        }
        at_ = 0;
        phase_ = Phase::kRestart;
        return;
      case Phase::kRestart:
        bit_edge();
        begin();
        acknowledged(write_byte(static_cast<uint8_t>(address_ << 1 | 1)));
        phase_ = Phase::kRead;
        return;
      case Phase::kRead:
        buffer_[at_] = read_byte(at_ + 1 < in_size_);
        ++at_;
        if (at_ == in_size_) {
          end(BusStatus::kDone);
        }
        return;
    }
  }

  bool acknowledged(bool acknowledge) {
    if (!acknowledge) {
      end(BusStatus::kNack);
    }
    return acknowledge;
  }

  // START: SDA falls while SCL is high. SCL rests high between bytes.
  void begin() {
    pins_.sda(false);
    pins_.half_bit();
  }

  // The slave lets go of its acknowledge when SCL falls; both lines are high behind it.
  void bit_edge() {
    pins_.scl(false);
    pins_.sda(true);
    pins_.half_bit();
    pins_.scl(true);
    pins_.half_bit();
  }

  void end(BusStatus status) {
    pins_.scl(false);
    pins_.sda(false);
    pins_.half_bit();
    pins_.scl(true);
    pins_.half_bit();
    pins_.sda(true);
    pins_.half_bit();
    status_ = status;
  }

  // SDA moves while SCL is low; the slave reads it while SCL is high.
  bool bit(bool value) {
    pins_.scl(false);
    pins_.sda(value);
    pins_.half_bit();
    pins_.scl(true);
    pins_.half_bit();
    return pins_.sda();
  }

  bool write_byte(uint8_t value) {
    for (uint8_t mask = 0x80; mask != 0; mask = static_cast<uint8_t>(mask >> 1)) {
      bit((value & mask) != 0);
    }
    return !bit(true);
  }

  uint8_t read_byte(bool more) {
    uint8_t value = 0;
    for (uint8_t i = 0; i < 8; ++i) {
      value = static_cast<uint8_t>(value << 1 | (bit(true) ? 1 : 0));
    }
    bit(!more);
    return value;
  }

  // UM10204 3.1.16: a slave stuck in a read lets SDA go within nine clocks.
  void recover() {
    pins_.sda(true);
    for (uint8_t i = 0; i < 9; ++i) {
      bit(true);
    }
    end(BusStatus::kStuck);
  }

  Pins& pins_;
  uint8_t* buffer_ = nullptr;
  uint32_t moved_us_ = 0;
  uint8_t address_ = 0;
  uint8_t out_size_ = 0;
  uint8_t in_size_ = 0;
  uint8_t at_ = 0;
  Phase phase_ = Phase::kStart;
  BusStatus status_ = BusStatus::kIdle;
};

}  // namespace drivers
