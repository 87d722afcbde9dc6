// The life of an SD card over SPI: start, single blocks, a stream in flight. No call waits. SD
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
  static constexpr uint32_t kBusyUs = 5000000UL;
  static constexpr uint16_t kPortion = 256;  // bytes of a block in a call

  explicit SdCard(Spi& spi) : spi_(spi), wire_(spi) {}

  // Initialisation: `start`, then `poll` until it is false.
  void start() {
    state_ = State::kPowerUp;
    wire_.set_status(CardStatus::kNoCard);
    started_us_ = spi_.now_us();
  }
  // One step, at most 1 ms at 250 kHz. True while it goes on.
  bool poll() {
    switch (state_) {
      case State::kPowerUp:
        return step(power_up());
      case State::kVoltage:
        return step(ask_voltage());
      case State::kCrcOn:
        return step(turn_crc_on());
      case State::kNegotiate:
        return step(negotiate());
      case State::kIdentify:
        return step(identify());
      case State::kCid:
        return step(take_cid());
      case State::kCsd:
        return step(take_csd());
      default:
        return false;
    }
  }
  bool initialised() const { return state_ >= State::kIdle; }
  CardStatus status() const { return wire_.status(); }  // of the last call that failed, or kOk
  const uint8_t* cid() const { return cid_; }           // 16 bytes
  uint32_t sectors() const { return sectors_; }
  bool high_capacity() const { return high_capacity_; }

  // ---- single blocks ----
  // After it, call `read` or `write` with the 512 bytes until it says kDone or kFailed. A step is
  // half a block, 0.6 ms, or a look at a card that is busy.
  void begin_block_at(uint32_t sector) {
    if (!initialised()) {
      return;
    }
    next_sector_ = sector;
    started_us_ = spi_.now_us();
    state_ = State::kAsking;
    spi_.select();
  }
  CardStep read(uint8_t* to) {
    if (state_ == State::kAsking) {
      return ask(Wire::kReadBlock, State::kReading);  // half a millisecond until the block comes
    }
    if (state_ != State::kReading) {
      return CardStep::kFailed;
    }
    const CardStep result = wire_.receive(to, 512, kPortion);
    if (result == CardStep::kAgain) {
      return wire_.sends() || !late(kReadUs) ? result : end(wire_.failed(CardStatus::kReadToken));
    }
    return end(result);
  }
  CardStep write(const uint8_t* from) {
    if (state_ == State::kAsking) {
      return ask(Wire::kWriteBlock, State::kSending);
    }
    if (state_ == State::kProgramming) {
      if (wire_.idle()) {
        return end(CardStep::kDone);
      }
      return late(kBusyUs) ? end(wire_.failed(CardStatus::kTimeout)) : CardStep::kAgain;
    }
    if (state_ != State::kSending) {
      return CardStep::kFailed;
    }
    if (sent_ == 0) {
      spi_.transfer(0xFF);
      wire_.open_block(Wire::kTokenBlock);
    }
    (void)wire_.put(from + sent_, kPortion, 0);
    sent_ = static_cast<uint16_t>(sent_ + kPortion);
    if (sent_ < 512) {
      return CardStep::kAgain;
    }
    if (wire_.close_block() != CardWrite::kAccepted) {
      return end(CardStep::kFailed);
    }
    state_ = State::kProgramming;
    started_us_ = spi_.now_us();
    return CardStep::kAgain;
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
  uint32_t put(const uint8_t* data, uint16_t size, uint32_t crc32) {
    return wire_.put(data, size, crc32);
  }
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
  // Ends the write; poll `closing` until false before any other call.
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
    kVoltage,
    kCrcOn,
    kNegotiate,
    kIdentify,
    kCid,
    kCsd,
    kIdle,
    kAsking,
    kReading,
    kSending,
    kProgramming,
    kStreaming,
    kStopping,
    kReopening
  };

  bool step(CardStep result) {
    if (result == CardStep::kAgain) {
      return true;
    }
    wire_.release();
    if (result == CardStep::kDone) {
      state_ = State::kIdle;
      wire_.set_status(CardStatus::kOk);
    } else {
      state_ = State::kOff;
    }
    return false;
  }
  CardStep next(State state) {
    state_ = state;
    return CardStep::kAgain;
  }
  bool late(uint32_t limit_us) const { return spi_.now_us() - started_us_ > limit_us; }
  CardStep end(CardStep result) {
    wire_.release();
    state_ = State::kIdle;
    return result;
  }
  // The command of a single block, once the card is idle.
  CardStep ask(uint8_t command, State then) {
    if (!wire_.idle()) {
      return late(kBusyUs) ? end(wire_.failed(CardStatus::kTimeout)) : CardStep::kAgain;
    }
    const uint8_t r1 = wire_.command(command, address(next_sector_));
    if (r1 != 0) {
      const bool gone = r1 == Wire::kNoAnswer;
      return end(wire_.failed(gone ? CardStatus::kNoResponse : CardStatus::kCommand));
    }
    wire_.expect();
    sent_ = 0;
    started_us_ = spi_.now_us();
    return next(then);
  }

  // Section 7.2.1: at least 74 clocks with chip select high, then CMD0, CMD8, CRC on.
  CardStep power_up() {
    spi_.slow();
    spi_.deselect();
    for (uint8_t i = 0; i < 10; ++i) {
      spi_.transfer(0xFF);
    }
    spi_.select();
    // A reset in flight meets a card that is still in a multi-block write, in the middle of a block
    // or busy: end that first. A card that is busy takes CMD0 and nothing behind it.
    const uint32_t since_us = spi_.now_us() - started_us_;
    if (!wire_.idle() && since_us <= kInitUs) {
      wire_.release();
      return CardStep::kAgain;
    }
    const uint8_t r1 = wire_.command(Wire::kGoIdle, 0);
    return r1 == Wire::kIdleBit ? next(State::kVoltage) : again_or_none();
  }

  CardStep again_or_none() {
    wire_.release();
    if (late(kInitUs / 2)) {
      return wire_.failed(CardStatus::kNoCard);
    }
    end_lost_write();
    return next(State::kPowerUp);
  }

  CardStep ask_voltage() {
    const uint8_t r1 = wire_.command(Wire::kSendIfCond, 0x1AA);
    if (r1 == Wire::kNoAnswer || (r1 & Wire::kIdleBit) == 0) {
      return again_or_none();
    }
    version_2_ = (r1 & Wire::kIllegalBit) == 0;
    if (version_2_) {
      uint8_t r7[4];
      wire_.receive_plain(r7, 4);
      if (r1 != Wire::kIdleBit || (r7[2] & 0x0F) != 1 || r7[3] != 0xAA) {
        return wire_.failed(CardStatus::kVoltage);
      }
    }
    return next(State::kCrcOn);
  }

  CardStep turn_crc_on() {
    return wire_.command(Wire::kCrcOnOff, 1) == Wire::kIdleBit ? next(State::kNegotiate)
                                                               : wire_.failed(CardStatus::kCommand);
  }

  void end_lost_write() {
    spi_.select();
    spi_.transfer(Wire::kTokenStop);
    for (uint8_t i = 0; i < 8; ++i) {
      spi_.transfer(0xFF);
    }
    spi_.deselect();
  }

  CardStep negotiate() {
    wire_.command(Wire::kApplication, 0);
    const uint8_t r1 = wire_.command(Wire::kSendOpCond, version_2_ ? 0x40000000UL : 0);
    if (r1 == Wire::kIdleBit) {
      return late(kInitUs) ? wire_.failed(CardStatus::kInitTimeout) : CardStep::kAgain;
    }
    if (r1 != 0) {
      return wire_.failed(CardStatus::kCommand);
    }
    spi_.fast();
    return next(State::kIdentify);
  }

  CardStep identify() {
    high_capacity_ = false;
    if (version_2_) {
      uint8_t ocr[4];
      if (wire_.command(Wire::kReadOcr, 0) != 0) {
        return wire_.failed(CardStatus::kCommand);
      }
      wire_.receive_plain(ocr, 4);
      high_capacity_ = (ocr[0] & 0b0100'0000) != 0;
    }
    if (!high_capacity_ && wire_.command(Wire::kSetBlockLength, 512) != 0) {
      return wire_.failed(CardStatus::kCommand);
    }
    return ask_register(Wire::kSendCid, State::kCid);
  }

  CardStep ask_register(uint8_t command, State then) {
    if (wire_.command(command, 0) != 0) {
      return wire_.failed(CardStatus::kCommand);
    }
    wire_.expect();
    started_us_ = spi_.now_us();
    return next(then);
  }

  CardStep take_cid() {
    const CardStep result = take_register(cid_);
    return result == CardStep::kDone ? ask_register(Wire::kSendCsd, State::kCsd) : result;
  }

  CardStep take_csd() {
    uint8_t csd[16];
    const CardStep result = take_register(csd);
    return result == CardStep::kDone ? read_capacity(csd) : result;
  }

  // All 16 bytes at once when they come.
  CardStep take_register(uint8_t* to) {
    const CardStep result = wire_.receive(to, 16, 16);
    const bool none = result == CardStep::kAgain && late(kReadUs);
    return none ? wire_.failed(CardStatus::kReadToken) : result;
  }

  // Section 5.3: C_SIZE of CSD version 1 and 2.
  CardStep read_capacity(const uint8_t* csd) {
    const uint8_t version = static_cast<uint8_t>(csd[0] >> 6);
    if (version == 1) {
      const uint32_t size = core::get_be24(csd + 7) & 0x3FFFFFUL;
      sectors_ = (size + 1) << 10;
      return CardStep::kDone;
    }
    if (version == 0) {
      const uint16_t size = static_cast<uint16_t>(
          ((csd[6] & 0x03U) << 10) | (static_cast<uint16_t>(csd[7]) << 2) | (csd[8] >> 6));
      const uint8_t multiplier =
          static_cast<uint8_t>((((csd[9] & 0x03U) << 1) | (csd[10] >> 7)) + 2);
      const uint8_t length = csd[5] & 0x0F;  // log2 of the read block length, 9 to 11
      if (length < 9 || length > 11) {
        return wire_.failed(CardStatus::kUnsupported);
      }
      sectors_ = (static_cast<uint32_t>(size) + 1) << (multiplier + length - 9);
      return CardStep::kDone;
    }
    return wire_.failed(CardStatus::kUnsupported);
  }

  uint32_t address(uint32_t sector) const { return high_capacity_ ? sector : sector << 9; }

  Spi& spi_;
  Wire wire_;
  uint32_t started_us_ = 0;
  uint32_t sectors_ = 0;
  uint32_t next_sector_ = 0;
  uint16_t sent_ = 0;  // bytes of a single block
  uint8_t cid_[16] = {};
  State state_ = State::kOff;
  bool high_capacity_ = false;
  bool version_2_ = false;
};

}  // namespace drivers
