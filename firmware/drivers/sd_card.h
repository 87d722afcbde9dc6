// The life of an SD card over SPI: start, single blocks on the ground, a stream in flight. SD
// Specifications Part 1, Physical Layer Simplified Specification 6.00, chapter 7.
#pragma once

#include <stdint.h>

#include "core/bytes.h"
#include "drivers/sd_wire.h"

namespace drivers {

// Spi: as SdWire, and
//      void slow(), fast()         at most 400 kHz; up to 25 MHz
template <typename Spi>
class SdCard {
 public:
  static constexpr uint32_t kInitUs = 1000000UL;
  static constexpr uint32_t kReadUs = 150000UL;
  static constexpr uint32_t kWriteUs = 1000000UL;

  explicit SdCard(Spi& spi) : spi_(spi), wire_(spi) {}

  // Initialisation that never waits: `start`, then `poll` until it is false.
  void start() {
    state_ = State::kPowerUp;
    wire_.set_status(CardStatus::kNoCard);
    started_us_ = spi_.now_us();
  }
  // One step, at most 1.5 ms at 400 kHz. True while it goes on.
  bool poll() {
    switch (state_) {
      case State::kPowerUp:
        return step(power_up());
      case State::kNegotiate:
        return step(negotiate());
      case State::kIdentify:
        return step(identify());
      case State::kOff:
      case State::kIdle:
      case State::kStreaming:
      case State::kStopping:
      case State::kReopening:
        break;
    }
    return false;
  }
  bool initialised() const { return state_ != State::kOff && state_ > State::kIdentify; }
  CardStatus status() const { return wire_.status(); }  // of the last call that failed, or kOk
  const uint8_t* cid() const { return cid_; }           // 16 bytes
  uint32_t sectors() const { return sectors_; }
  bool high_capacity() const { return high_capacity_; }

  // ---- on the ground: calls that wait, at most as long as the card may be busy ----
  bool read(uint32_t sector, uint8_t* to) {
    if (!idle_for_command()) {
      return false;
    }
    const bool good = wire_.command(Wire::kReadBlock, address(sector)) == 0
                          ? wire_.receive(to, 512, kReadUs)
                          : wire_.fail(CardStatus::kCommand);
    wire_.release();
    return good;
  }
  bool write(uint32_t sector, const uint8_t* from) {
    if (!idle_for_command()) {
      return false;
    }
    bool good = wire_.fail(CardStatus::kCommand);
    if (wire_.command(Wire::kWriteBlock, address(sector)) == 0) {
      spi_.transfer(0xFF);
      wire_.open_block(Wire::kTokenBlock);
      wire_.put(from, 512);
      good = wire_.close_block() == CardWrite::kAccepted &&
             (wire_.wait_idle(kWriteUs) || wire_.fail(CardStatus::kTimeout));
    }
    wire_.release();
    return good;
  }

  // ---- in flight: a multi-block write that never waits ----
  // After it, call `ready` until true, then begin_block, put 512 bytes, end_block.
  void open_stream(uint32_t sector) {
    wire_.set_status(CardStatus::kOk);
    next_sector_ = sector;
    state_ = State::kReopening;
    spi_.select();
  }
  // One byte on the bus while the card is busy. True: a block may begin.
  bool ready() {
    if (state_ != State::kStreaming && state_ != State::kReopening && state_ != State::kStopping) {
      return false;
    }
    if (spi_.transfer(0xFF) != 0xFF) {
      return false;
    }
    if (state_ == State::kStopping) {
      wire_.release();
      state_ = State::kIdle;
      return false;
    }
    if (state_ == State::kReopening) {
      if (wire_.command(Wire::kWriteMany, address(next_sector_)) != 0) {
        wire_.set_status(CardStatus::kCommand);
        return false;
      }
      state_ = State::kStreaming;
    }
    return true;
  }
  void begin_block() {
    spi_.transfer(0xFF);
    wire_.open_block(Wire::kTokenMany);
  }
  void put(const uint8_t* data, uint16_t size) { wire_.put(data, size); }
  CardWrite end_block() {
    const CardWrite result = wire_.close_block();
    if (result == CardWrite::kAccepted) {
      ++next_sector_;
    } else {
      // Section 7.3.3.1: after a rejected block the host stops the write with CMD12.
      wire_.command(Wire::kStop, 0);
      state_ = State::kReopening;
    }
    return result;
  }
  // Ends the write; poll `closing` until false before any call that waits.
  void close_stream() {
    if (state_ == State::kStreaming) {
      wire_.stop_token();
    }
    state_ = State::kStopping;
  }
  bool closing() {
    ready();
    return state_ == State::kStopping;
  }
  uint32_t next_sector() const { return next_sector_; }

 private:
  using Wire = SdWire<Spi>;

  enum class State : uint8_t {
    kOff,
    kPowerUp,
    kNegotiate,
    kIdentify,
    kIdle,
    kStreaming,
    kStopping,
    kReopening
  };
  enum class Step : uint8_t { kAgain, kDone, kFailed };

  bool step(Step result) {
    if (result == Step::kAgain) {
      return true;
    }
    wire_.release();
    if (result == Step::kDone) {
      state_ = State::kIdle;
      wire_.set_status(CardStatus::kOk);
    } else {
      state_ = State::kOff;
    }
    return false;
  }

  // Section 7.2.1: at least 74 clocks with chip select high, then CMD0, CMD8, CRC on.
  Step power_up() {
    spi_.slow();
    spi_.deselect();
    for (uint8_t i = 0; i < 10; ++i) {
      spi_.transfer(0xFF);
    }
    spi_.select();
    // A reset in flight meets a card that is still in a multi-block write, in the middle of a block
    // or busy: end that first. A card that is busy takes CMD0 and nothing behind it.
    const uint32_t since_us = spi_.now_us() - started_us_;
    if (spi_.transfer(0xFF) != 0xFF && since_us <= kInitUs) {
      wire_.release();
      return Step::kAgain;
    }
    uint8_t r1 = wire_.command(Wire::kGoIdle, 0);
    if (r1 == Wire::kIdleBit) {
      r1 = wire_.command(Wire::kSendIfCond, 0x1AA);
    }
    if (r1 == Wire::kNoAnswer || (r1 & Wire::kIdleBit) == 0) {
      wire_.release();
      if (since_us > kInitUs / 2) {
        wire_.set_status(CardStatus::kNoCard);
        return Step::kFailed;
      }
      end_lost_write();
      return Step::kAgain;
    }
    version_2_ = (r1 & Wire::kIllegalBit) == 0;
    if (version_2_) {
      uint8_t r7[4];
      wire_.receive_plain(r7, 4);
      if (r1 != Wire::kIdleBit || (r7[2] & 0x0F) != 1 || r7[3] != 0xAA) {
        wire_.set_status(CardStatus::kVoltage);
        return Step::kFailed;
      }
    }
    if (wire_.command(Wire::kCrcOnOff, 1) != Wire::kIdleBit) {
      wire_.set_status(CardStatus::kCommand);
      return Step::kFailed;
    }
    state_ = State::kNegotiate;
    return Step::kAgain;
  }

  void end_lost_write() {
    spi_.select();
    spi_.transfer(Wire::kTokenStop);
    for (uint8_t i = 0; i < 8; ++i) {
      spi_.transfer(0xFF);
    }
    spi_.deselect();
  }

  Step negotiate() {
    wire_.command(Wire::kApplication, 0);
    const uint8_t r1 = wire_.command(Wire::kSendOpCond, version_2_ ? 0x40000000UL : 0);
    if (r1 == Wire::kIdleBit) {
      if (spi_.now_us() - started_us_ > kInitUs) {
        wire_.set_status(CardStatus::kInitTimeout);
        return Step::kFailed;
      }
      return Step::kAgain;
    }
    if (r1 != 0) {
      wire_.set_status(CardStatus::kCommand);
      return Step::kFailed;
    }
    state_ = State::kIdentify;
    spi_.fast();
    return Step::kAgain;
  }

  Step identify() {
    wire_.set_status(CardStatus::kCommand);
    high_capacity_ = false;
    if (version_2_) {
      uint8_t ocr[4];
      if (wire_.command(Wire::kReadOcr, 0) != 0) {
        return Step::kFailed;
      }
      wire_.receive_plain(ocr, 4);
      high_capacity_ = (ocr[0] & 0b0100'0000) != 0;
    }
    if (!high_capacity_ && wire_.command(Wire::kSetBlockLength, 512) != 0) {
      return Step::kFailed;
    }
    uint8_t csd[16];
    if (wire_.command(Wire::kSendCid, 0) != 0 || !wire_.receive(cid_, 16, kReadUs) ||
        wire_.command(Wire::kSendCsd, 0) != 0 || !wire_.receive(csd, 16, kReadUs)) {
      return Step::kFailed;
    }
    return read_capacity(csd) ? Step::kDone : Step::kFailed;
  }

  // Section 5.3: C_SIZE of CSD version 1 and 2.
  bool read_capacity(const uint8_t* csd) {
    const uint8_t version = static_cast<uint8_t>(csd[0] >> 6);
    if (version == 1) {
      const uint32_t size = core::get_be24(csd + 7) & 0x3FFFFFUL;
      sectors_ = (size + 1) << 10;
      return true;
    }
    if (version == 0) {
      const uint16_t size = static_cast<uint16_t>(
          ((csd[6] & 0x03U) << 10) | (static_cast<uint16_t>(csd[7]) << 2) | (csd[8] >> 6));
      const uint8_t multiplier =
          static_cast<uint8_t>((((csd[9] & 0x03U) << 1) | (csd[10] >> 7)) + 2);
      const uint8_t length = csd[5] & 0x0F;  // log2 of the read block length, 9 to 11
      if (length < 9 || length > 11) {
        return wire_.fail(CardStatus::kUnsupported);
      }
      sectors_ = (static_cast<uint32_t>(size) + 1) << (multiplier + length - 9);
      return true;
    }
    return wire_.fail(CardStatus::kUnsupported);
  }

  uint32_t address(uint32_t sector) const { return high_capacity_ ? sector : sector << 9; }

  bool idle_for_command() {
    if (state_ != State::kIdle) {
      return false;
    }
    spi_.select();
    if (wire_.wait_idle(kWriteUs)) {
      return true;
    }
    wire_.release();
    return wire_.fail(CardStatus::kTimeout);
  }

  Spi& spi_;
  Wire wire_;
  uint32_t started_us_ = 0;
  uint32_t sectors_ = 0;
  uint32_t next_sector_ = 0;
  uint8_t cid_[16] = {};
  State state_ = State::kOff;
  bool high_capacity_ = false;
  bool version_2_ = false;
};

}  // namespace drivers
