// SD cards over SPI: SD Specifications Part 1, Physical Layer Simplified Specification 6.00,
// chapter 7.
#pragma once

#include <stdint.h>

#include "core/bytes.h"
#include "core/crc.h"

namespace drivers {

// Argument of the event `card_error`.
enum class CardStatus : uint8_t {
  kOk = 0,
  kNoCard = 1,       // no answer to CMD0
  kVoltage = 2,      // refuses 3.3 V
  kInitTimeout = 3,  // ACMD41 not done within 1 s
  kCommand = 4,      // a command was answered with an error
  kReadToken = 5,    // no data, or an error token
  kReadCrc = 6,
  kWriteCrc = 7,      // data response 101: the card saw a wrong CRC
  kWriteError = 8,    // data response 110
  kNoResponse = 9,    // no data response: the card is gone
  kTimeout = 10,      // busy for longer than 1 s in a call that waits
  kUnsupported = 11,  // CSD of another kind
};

enum class CardWrite : uint8_t {
  kAccepted,  // the card programs it now
  kRejected,  // send the same block again: `ready` reopens the stream at its sector
  kGone,      // no answer: removed or dead
};

// Spi: uint8_t transfer(uint8_t)   one byte out and in
//      void send(uint8_t)          one byte out; may return while it is shifted
//      void select(), deselect()   chip select low, high
//      void slow(), fast()         at most 400 kHz; up to 25 MHz
//      uint32_t now_us()
//      void waiting()              called again and again while a call waits
template <typename Spi>
class SdCard {
 public:
  static constexpr uint32_t kInitUs = 1000000UL;
  static constexpr uint32_t kReadUs = 150000UL;
  static constexpr uint32_t kWriteUs = 1000000UL;

  explicit SdCard(Spi& spi) : spi_(spi) {}

  // Initialisation that never waits: `start`, then `poll` until it is false.
  void start() {
    state_ = State::kPowerUp;
    status_ = CardStatus::kNoCard;
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
  CardStatus status() const { return status_; }  // of the last call that failed, or kOk
  const uint8_t* cid() const { return cid_; }    // 16 bytes
  uint32_t sectors() const { return sectors_; }
  bool high_capacity() const { return high_capacity_; }

  // ---- on the ground: calls that wait, at most as long as the card may be busy ----
  bool read(uint32_t sector, uint8_t* to) {
    if (!idle_for_command()) {
      return false;
    }
    const bool good = command(kReadBlock, address(sector)) == 0 ? receive(to, 512, kReadUs)
                                                                : fail(CardStatus::kCommand);
    release();
    return good;
  }
  bool write(uint32_t sector, const uint8_t* from) {
    if (!idle_for_command()) {
      return false;
    }
    bool good = fail(CardStatus::kCommand);
    if (command(kWriteBlock, address(sector)) == 0) {
      spi_.transfer(0xFF);
      open_block(kTokenBlock);
      put(from, 512);
      good = close_block() == CardWrite::kAccepted &&
             (wait_idle(kWriteUs) || fail(CardStatus::kTimeout));
    }
    release();
    return good;
  }

  // ---- in flight: a multi-block write that never waits ----
  // After it, call `ready` until true, then begin_block, put 512 bytes, end_block.
  void open_stream(uint32_t sector) {
    status_ = CardStatus::kOk;
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
      release();
      state_ = State::kIdle;
      return false;
    }
    if (state_ == State::kReopening) {
      if (command(kWriteMany, address(next_sector_)) != 0) {
        status_ = CardStatus::kCommand;
        return false;
      }
      state_ = State::kStreaming;
    }
    return true;
  }
  void begin_block() {
    spi_.transfer(0xFF);
    open_block(kTokenMany);
  }
  void put(const uint8_t* data, uint16_t size) {
    uint16_t crc = crc_;
    while (size-- != 0) {
      const uint8_t byte = *data++;
      spi_.send(byte);
      crc = core::crc16_add(crc, byte);
    }
    crc_ = crc;
  }
  CardWrite end_block() {
    const CardWrite result = close_block();
    if (result == CardWrite::kAccepted) {
      ++next_sector_;
    } else {
      // Section 7.3.3.1: after a rejected block the host stops the write with CMD12.
      command(kStop, 0);
      state_ = State::kReopening;
    }
    return result;
  }
  // Ends the write; poll `closing` until false before any call that waits.
  void close_stream() {
    if (state_ == State::kStreaming) {
      stop_token();
    }
    state_ = State::kStopping;
  }
  bool closing() {
    ready();
    return state_ == State::kStopping;
  }
  uint32_t next_sector() const { return next_sector_; }

 private:
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

  static constexpr uint8_t kGoIdle = 0, kSendIfCond = 8, kSendCsd = 9, kSendCid = 10, kStop = 12;
  static constexpr uint8_t kSetBlockLength = 16, kReadBlock = 17, kWriteBlock = 24;
  static constexpr uint8_t kWriteMany = 25, kSendOpCond = 41, kApplication = 55, kReadOcr = 58;
  static constexpr uint8_t kCrcOnOff = 59;
  static constexpr uint8_t kTokenBlock = 0xFE, kTokenMany = 0xFC, kTokenStop = 0xFD;
  static constexpr uint8_t kIdleBit = 0b0000'0001, kIllegalBit = 0b0000'0100, kNoAnswer = 0xFF;

  bool fail(CardStatus status) {
    status_ = status;
    return false;
  }

  bool step(Step result) {
    if (result == Step::kAgain) {
      return true;
    }
    release();
    if (result == Step::kDone) {
      state_ = State::kIdle;
      status_ = CardStatus::kOk;
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
      release();
      return Step::kAgain;
    }
    uint8_t r1 = command(kGoIdle, 0);
    if (r1 == kIdleBit) {
      r1 = command(kSendIfCond, 0x1AA);
    }
    if (r1 == kNoAnswer || (r1 & kIdleBit) == 0) {
      release();
      if (since_us > kInitUs / 2) {
        status_ = CardStatus::kNoCard;
        return Step::kFailed;
      }
      end_lost_write();
      return Step::kAgain;
    }
    version_2_ = (r1 & kIllegalBit) == 0;
    if (version_2_) {
      uint8_t r7[4];
      receive_plain(r7, 4);
      if (r1 != kIdleBit || (r7[2] & 0x0F) != 1 || r7[3] != 0xAA) {
        status_ = CardStatus::kVoltage;
        return Step::kFailed;
      }
    }
    if (command(kCrcOnOff, 1) != kIdleBit) {
      status_ = CardStatus::kCommand;
      return Step::kFailed;
    }
    state_ = State::kNegotiate;
    return Step::kAgain;
  }

  void end_lost_write() {
    spi_.select();
    spi_.transfer(kTokenStop);
    for (uint8_t i = 0; i < 8; ++i) {
      spi_.transfer(0xFF);
    }
    spi_.deselect();
  }

  Step negotiate() {
    command(kApplication, 0);
    const uint8_t r1 = command(kSendOpCond, version_2_ ? 0x40000000UL : 0);
    if (r1 == kIdleBit) {
      if (spi_.now_us() - started_us_ > kInitUs) {
        status_ = CardStatus::kInitTimeout;
        return Step::kFailed;
      }
      return Step::kAgain;
    }
    if (r1 != 0) {
      status_ = CardStatus::kCommand;
      return Step::kFailed;
    }
    state_ = State::kIdentify;
    spi_.fast();
    return Step::kAgain;
  }

  Step identify() {
    status_ = CardStatus::kCommand;
    high_capacity_ = false;
    if (version_2_) {
      uint8_t ocr[4];
      if (command(kReadOcr, 0) != 0) {
        return Step::kFailed;
      }
      receive_plain(ocr, 4);
      high_capacity_ = (ocr[0] & 0b0100'0000) != 0;
    }
    if (!high_capacity_ && command(kSetBlockLength, 512) != 0) {
      return Step::kFailed;
    }
    uint8_t csd[16];
    if (command(kSendCid, 0) != 0 || !receive(cid_, 16, kReadUs) || command(kSendCsd, 0) != 0 ||
        !receive(csd, 16, kReadUs)) {
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
        return fail(CardStatus::kUnsupported);
      }
      sectors_ = (static_cast<uint32_t>(size) + 1) << (multiplier + length - 9);
      return true;
    }
    return fail(CardStatus::kUnsupported);
  }

  uint32_t address(uint32_t sector) const { return high_capacity_ ? sector : sector << 9; }

  // R1, or kNoAnswer. Section 7.3.1.1; CRC-7 in bits 7 to 1.
  uint8_t command(uint8_t index, uint32_t argument) {
    uint8_t crc = 0;
    spi_.transfer(0xFF);
    send_crc7(static_cast<uint8_t>(0x40 | index), crc);
    for (uint8_t shift = 32; shift != 0;) {
      shift = static_cast<uint8_t>(shift - 8);
      send_crc7(static_cast<uint8_t>(argument >> shift), crc);
    }
    spi_.transfer(static_cast<uint8_t>(crc | 1));
    if (index == kStop) {
      spi_.transfer(0xFF);  // a stuff byte stands before the answer of CMD12
    }
    for (uint8_t i = 0; i < 9; ++i) {
      const uint8_t r1 = spi_.transfer(0xFF);
      if ((r1 & 0x80) == 0) {
        return r1;
      }
    }
    return kNoAnswer;
  }

  void send_crc7(uint8_t byte, uint8_t& crc) {
    spi_.transfer(byte);
    crc = static_cast<uint8_t>(crc ^ byte);
    for (uint8_t bit = 0; bit < 8; ++bit) {
      crc = static_cast<uint8_t>((crc & 0x80) != 0 ? (crc << 1) ^ 0x12 : crc << 1);
    }
  }

  void receive_plain(uint8_t* to, uint8_t size) {
    while (size-- != 0) {
      *to++ = spi_.transfer(0xFF);
    }
  }

  bool receive(uint8_t* to, uint16_t size, uint32_t limit_us) {
    const uint32_t from_us = spi_.now_us();
    uint8_t token = 0xFF;
    do {
      if (spi_.now_us() - from_us > limit_us) {
        return fail(CardStatus::kReadToken);
      }
      spi_.waiting();  // at least once: a search reads thousands of blocks of a card that is quick
      token = spi_.transfer(0xFF);
    } while (token == 0xFF);
    if (token != kTokenBlock) {
      return fail(CardStatus::kReadToken);
    }
    uint16_t crc = core::kCrc16StartCard;
    while (size-- != 0) {
      const uint8_t byte = spi_.transfer(0xFF);
      *to++ = byte;
      crc = core::crc16_add(crc, byte);
    }
    crc = core::crc16_add(crc, spi_.transfer(0xFF));
    crc = core::crc16_add(crc, spi_.transfer(0xFF));
    return crc == 0 || fail(CardStatus::kReadCrc);
  }

  void open_block(uint8_t token) {
    spi_.transfer(token);
    crc_ = core::kCrc16StartCard;
  }

  CardWrite close_block() {
    const uint16_t crc = crc_;
    spi_.send(static_cast<uint8_t>(crc >> 8));
    spi_.send(static_cast<uint8_t>(crc));
    const uint8_t response = spi_.transfer(0xFF) & 0x1F;
    if (response == 0b0'0101) {
      return CardWrite::kAccepted;
    }
    if (response == 0b0'1011 || response == 0b0'1101) {
      status_ = response == 0b0'1011 ? CardStatus::kWriteCrc : CardStatus::kWriteError;
      return CardWrite::kRejected;
    }
    status_ = CardStatus::kNoResponse;
    return CardWrite::kGone;
  }

  void stop_token() {
    spi_.transfer(kTokenStop);
    spi_.transfer(0xFF);  // busy begins after one byte
  }

  bool wait_idle(uint32_t limit_us) {
    const uint32_t from_us = spi_.now_us();
    while (spi_.transfer(0xFF) != 0xFF) {
      if (spi_.now_us() - from_us > limit_us) {
        return false;
      }
      spi_.waiting();
    }
    return true;
  }

  bool idle_for_command() {
    if (state_ != State::kIdle) {
      return false;
    }
    spi_.select();
    if (wait_idle(kWriteUs)) {
      return true;
    }
    release();
    return fail(CardStatus::kTimeout);
  }

  void release() {
    spi_.deselect();
    spi_.transfer(0xFF);  // the card lets go of the line one byte after its chip select
  }

  Spi& spi_;
  uint32_t started_us_ = 0;
  uint32_t sectors_ = 0;
  uint32_t next_sector_ = 0;
  uint16_t crc_ = 0;
  uint8_t cid_[16] = {};
  State state_ = State::kOff;
  CardStatus status_ = CardStatus::kNoCard;
  bool high_capacity_ = false;
  bool version_2_ = false;
};

}  // namespace drivers
