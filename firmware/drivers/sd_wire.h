// What goes over the wire to an SD card in SPI mode: commands and their answers, blocks with their
// CRC. SD Specifications Part 1, Physical Layer Simplified Specification 6.00, section 7.3.
#pragma once

#include <stdint.h>

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
  kTimeout = 10,      // busy for longer than 5 s with a single block
  kUnsupported = 11,  // CSD of another kind
};

// Of what goes on over many calls.
enum class CardStep : uint8_t { kAgain, kDone, kFailed };

enum class CardWrite : uint8_t {
  kAccepted,  // the card programs it now
  kRejected,  // send the same block again: `ready` reopens the stream at its sector
  kGone,      // no answer: removed or dead
};

// Spi: uint8_t transfer(uint8_t)   one byte out and in
//      void send(uint8_t)          one byte out; may return while it is shifted
//      uint32_t send_all(const uint8_t*, uint16_t, uint16_t& crc16, uint32_t crc32)
//                                  many, added to both meanwhile; the second's state behind them
//      void ask()                  begins a byte in
//      uint8_t next(), last()      that byte, with another begun or not
//      void select(), deselect()   chip select low, high
//      uint32_t now_us()
template <typename Spi>
class SdWire {
 public:
  static constexpr uint8_t kGoIdle = 0, kSendIfCond = 8, kSendCsd = 9, kSendCid = 10, kStop = 12;
  static constexpr uint8_t kSetBlockLength = 16, kReadBlock = 17, kWriteBlock = 24;
  static constexpr uint8_t kWriteMany = 25, kSendOpCond = 41, kApplication = 55, kReadOcr = 58;
  static constexpr uint8_t kCrcOnOff = 59;
  static constexpr uint8_t kTokenBlock = 0xFE, kTokenMany = 0xFC, kTokenStop = 0xFD;
  static constexpr uint8_t kIdleBit = 0b0000'0001, kIllegalBit = 0b0000'0100, kNoAnswer = 0xFF;

  explicit SdWire(Spi& spi) : spi_(spi) {}

  CardStatus status() const { return status_; }  // of the last call that failed, or as set
  void set_status(CardStatus status) { status_ = status; }
  CardStep failed(CardStatus status) {
    status_ = status;
    return CardStep::kFailed;
  }

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

  void receive_plain(uint8_t* to, uint8_t size) {
    while (size-- != 0) {
      *to++ = spi_.transfer(0xFF);
    }
  }

  // A block comes that the card sends by itself; call `receive` until it is there.
  void expect() {
    at_ = 0;
    sends_ = false;
  }
  bool sends() const { return sends_; }  // the block has begun to come
  // At most `most` bytes of a block of `size`; a few looks at the bus while there is none.
  CardStep receive(uint8_t* to, uint16_t size, uint16_t most) {
    if (!sends_) {
      uint8_t token = 0xFF;
      for (uint8_t looks = kLooks; looks != 0 && token == 0xFF; --looks) {
        token = spi_.transfer(0xFF);
      }
      if (token == 0xFF) {
        return CardStep::kAgain;
      }
      if (token != kTokenBlock) {
        return failed(CardStatus::kReadToken);
      }
      sends_ = true;
      crc_ = core::kCrc16StartCard;
      spi_.ask();
    }
    const uint16_t left = static_cast<uint16_t>(size - at_);
    uint16_t count = left < most ? left : most;
    uint16_t crc = crc_;
    uint8_t* next = to + at_;
    at_ = static_cast<uint16_t>(at_ + count);
    while (count-- != 0) {
      const uint8_t byte = spi_.next();  // the one behind it comes meanwhile
      *next++ = byte;
      crc = core::crc16_add(crc, byte);
    }
    crc_ = crc;
    if (at_ < size) {
      return CardStep::kAgain;
    }
    crc = core::crc16_add(crc, spi_.next());
    crc = core::crc16_add(crc, spi_.last());
    return crc == 0 ? CardStep::kDone : failed(CardStatus::kReadCrc);
  }

  void open_block(uint8_t token) {
    spi_.transfer(token);
    crc_ = core::kCrc16StartCard;
  }

  // Bytes of the block, and a CRC-32 of them for whoever wants one.
  uint32_t put(const uint8_t* data, uint16_t size, uint32_t crc32) {
    return spi_.send_all(data, size, crc_, crc32);
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

  // One byte on the bus: not busy.
  bool idle() { return spi_.transfer(0xFF) == 0xFF; }

  void release() {
    spi_.deselect();
    spi_.transfer(0xFF);  // the card lets go of the line one byte after its chip select
  }

 private:
  void send_crc7(uint8_t byte, uint8_t& crc) {
    spi_.transfer(byte);
    crc = static_cast<uint8_t>(crc ^ byte);
    for (uint8_t bit = 0; bit < 8; ++bit) {
      crc = static_cast<uint8_t>((crc & 0x80) != 0 ? (crc << 1) ^ 0x12 : crc << 1);
    }
  }

  static constexpr uint8_t kLooks = 16;  // 35 us

  Spi& spi_;
  uint16_t crc_ = 0;
  uint16_t at_ = 0;     // bytes received
  bool sends_ = false;  // they come
  CardStatus status_ = CardStatus::kNoCard;
};

}  // namespace drivers
