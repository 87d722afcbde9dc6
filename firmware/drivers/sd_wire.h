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
//      uint32_t now_us()
//      void waiting()              called again and again while a call waits
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
  bool fail(CardStatus status) {
    status_ = status;
    return false;
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

  void put(const uint8_t* data, uint16_t size) {
    uint16_t crc = crc_;
    while (size-- != 0) {
      const uint8_t byte = *data++;
      spi_.send(byte);
      crc = core::crc16_add(crc, byte);
    }
    crc_ = crc;
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

  Spi& spi_;
  uint16_t crc_ = 0;
  CardStatus status_ = CardStatus::kNoCard;
};

}  // namespace drivers
