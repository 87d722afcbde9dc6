// An SD card at the level of SPI bytes, with faults to switch on. Checks what the host sends.
#pragma once

#include <stdint.h>
#include <string.h>

#include "core/bytes.h"
#include "core/crc.h"

class ModelCard {
 public:
  static constexpr uint8_t kSectors = 4;  // 2 KB: it must fit beside the suite on the AVR

  // ---- what a test sets ----
  bool present = true;
  bool version_2 = true;
  bool high_capacity = true;
  bool wrong_voltage = false;
  uint16_t negotiations = 3;     // ACMD41 answers idle this often
  uint8_t gap_bytes = 2;         // before a block to the host
  uint16_t busy_bytes = 5;       // after each block; 0xFFFF: for ever
  uint32_t base = 0;             // first sector kept
  int16_t flip_byte = -1;        // of the next data block from the host, on the wire
  bool write_error = false;      // on the next block
  bool flip_read = false;        // a byte of the next block to the host
  bool error_token = false;      // instead of the next block to the host
  uint8_t refuses = 0xFF;        // the command with this index is answered with an error
  uint8_t silent = 0xFF;         // behind this one no block comes
  uint8_t echo = 0xAA;           // the last byte of CMD8's answer
  uint8_t volts = 1;             // and the one before it
  const uint8_t* csd = nullptr;  // instead of the model's own

  // ---- what a test looks at ----
  uint8_t store[kSectors][512] = {};
  uint16_t free_clocks = 0;   // bytes before the first select
  uint16_t bad_commands = 0;  // wrong CRC-7 or a command the state does not allow
  uint32_t bytes = 0;         // on the bus since power-on
  bool is_fast = false;
  bool crc_on = false;
  uint8_t resets = 0;   // CMD0
  uint8_t opened = 0;   // CMD25
  uint8_t stopped = 0;  // CMD12 and stop tokens

  // ---- the bus ----
  uint8_t transfer(uint8_t out) {
    ++bytes;
    clock_us_ += is_fast ? 2 : 20;
    if (!selected_) {
      free_clocks = static_cast<uint16_t>(free_clocks + (ever_selected_ ? 0 : 1));
      return 0xFF;
    }
    if (!present) {
      return 0xFF;
    }
    const uint8_t reply = next_reply();
    take(out);
    return reply;
  }
  uint32_t send_all(const uint8_t* from, uint16_t size, uint16_t& crc16, uint32_t crc32) {
    core::Crc32 crc;
    crc.set_state(crc32);
    crc.add(from, size);
    for (uint16_t i = 0; i < size; ++i) {
      crc16 = core::crc16_add(crc16, from[i]);
      transfer(from[i]);
    }
    return crc.state();
  }
  void send(uint8_t out) { transfer(out); }
  void ask() { asked_ = transfer(0xFF); }
  uint8_t next() {
    const uint8_t byte = asked_;
    ask();
    return byte;
  }
  uint8_t last() const { return asked_; }
  void select() {
    selected_ = true;
    ever_selected_ = true;
  }
  void deselect() { selected_ = false; }
  void slow() { is_fast = false; }
  void fast() { is_fast = true; }
  uint32_t now_us() const { return clock_us_; }
  void advance_us(uint32_t us) { clock_us_ += us; }
  // As after a reset of the Mega in the middle of a block.
  void leave_in_block() {
    receiving_ = Receiving::kData;
    many_ = true;
    at_ = 100;
  }
  // As after a reset while it programs: it takes CMD0, and nothing behind it.
  void leave_busy(uint16_t for_bytes) { busy_ = for_bytes; }

 private:
  uint8_t asked_ = 0xFF;

  enum class Receiving : uint8_t { kCommand, kToken, kData };

  void queue(uint8_t byte) { replies_[queued_++] = byte; }

  uint8_t next_reply() {
    if (replied_ < queued_) {
      return replies_[replied_++];
    }
    replied_ = 0;
    queued_ = 0;
    if (sending_ != 0) {
      return next_of_block();
    }
    if (busy_ != 0) {
      busy_ = static_cast<uint16_t>(busy_ == 0xFFFF ? busy_ : busy_ - 1);
      return 0x00;
    }
    return 0xFF;
  }

  // Gap, token, data, CRC: counts down.
  uint8_t next_of_block() {
    const uint16_t left = sending_--;
    if (left > source_size_ + 3U) {
      return 0xFF;
    }
    if (left == source_size_ + 3U) {
      if (error_token) {
        error_token = false;
        sending_ = 0;
        return 0b0000'1000;
      }
      return 0xFE;
    }
    if (left > 2) {
      const uint8_t byte = source_[source_size_ + 2U - left];
      if (flip_read && left == 10) {
        flip_read = false;
        return byte ^ 0x10;
      }
      return byte;
    }
    const uint16_t crc = core::crc16(core::kCrc16StartCard, source_, source_size_);
    return static_cast<uint8_t>(left == 2 ? crc >> 8 : crc);
  }

  void send_block(const uint8_t* from, uint16_t size) {
    source_ = from;
    source_size_ = size;
    sending_ = silent_ ? uint16_t{0} : static_cast<uint16_t>(size + 3 + gap_bytes);
  }

  void take(uint8_t out) {
    switch (receiving_) {
      case Receiving::kCommand:
        take_command(out);
        return;
      case Receiving::kToken:
        take_token(out);
        return;
      case Receiving::kData:
        take_data(out);
        return;
    }
  }

  void take_command(uint8_t out) {
    if (at_ == 0 && (out & 0xC0) != 0x40) {
      return;
    }
    command_[at_++] = out;
    if (at_ < 6) {
      return;
    }
    at_ = 0;
    if (busy_ != 0 && (command_[0] & 0x3F) != 0) {
      return;
    }
    uint8_t crc = 0;
    for (uint8_t i = 0; i < 5; ++i) {
      crc = static_cast<uint8_t>(crc ^ command_[i]);
      for (uint8_t bit = 0; bit < 8; ++bit) {
        crc = static_cast<uint8_t>((crc & 0x80) != 0 ? (crc << 1) ^ 0x12 : crc << 1);
      }
    }
    if (command_[5] != static_cast<uint8_t>(crc | 1)) {
      ++bad_commands;
    }
    const uint32_t argument =
        static_cast<uint32_t>(command_[1]) << 24 | core::get_be24(command_ + 2);
    const uint8_t index = command_[0] & 0x3F;
    // These have no argument: as every host sends them, their bits are 0.
    const uint8_t bare[] = {0, 9, 10, 12, 55, 58};
    for (const uint8_t one : bare) {
      bad_commands = static_cast<uint16_t>(bad_commands + (one == index && argument != 0));
    }
    execute(index, argument);
  }

  void execute(uint8_t index, uint32_t argument) {
    const bool application = application_;
    application_ = false;
    queue(0xFF);
    const uint8_t r1 = idle_ ? 1 : 0;
    if (index == refuses) {
      queue(static_cast<uint8_t>(r1 | 0x20));
      return;
    }
    silent_ = index == silent;
    switch (index) {
      case 0:
        idle_ = true;
        ++resets;
        queue(1);
        return;
      case 8:
        queue(static_cast<uint8_t>(version_2 ? r1 : r1 | 4));
        if (version_2) {
          queue(0);
          queue(0);
          queue(wrong_voltage ? 0 : volts);
          queue(argument == 0x1AA ? echo : uint8_t{0});
        }
        return;
      case 9:
        make_csd();
        queue(r1);
        send_block(csd_, 16);
        return;
      case 10:
        for (uint8_t i = 0; i < 16; ++i) {
          csd_[i] = static_cast<uint8_t>(0xC0 + i);
        }
        queue(r1);
        send_block(csd_, 16);
        return;
      case 12:
        queue(0xFF);
        queue(0);
        ++stopped;
        many_ = false;
        receiving_ = Receiving::kCommand;
        busy_ = busy_bytes;
        return;
      case 17:
        queue(0);
        send_block(store[sector(argument)], 512);
        return;
      case 24:
      case 25:
        queue(0);
        many_ = index == 25;
        opened = static_cast<uint8_t>(opened + many_);
        sector_ = sector(argument);
        receiving_ = Receiving::kToken;
        return;
      case 41:
        if (!application || (version_2 && (argument & 0x40000000U) == 0)) {
          queue(static_cast<uint8_t>(r1 | 4));
          return;
        }
        idle_ = negotiations != 0;
        negotiations = static_cast<uint16_t>(negotiations - (idle_ ? 1 : 0));
        queue(idle_ ? 1 : 0);
        return;
      case 55:
        application_ = true;
        queue(r1);
        return;
      case 58:
        queue(r1);
        queue(high_capacity ? 0xC0 : 0x80);
        queue(0xFF);
        queue(0x80);
        queue(0);
        return;
      case 59:
        crc_on = argument == 1;
        queue(r1);
        return;
      case 16:
        queue(argument == 512 ? r1 : static_cast<uint8_t>(r1 | 0x40));
        return;
      default:
        ++bad_commands;
        queue(static_cast<uint8_t>(r1 | 4));
        return;
    }
  }

  uint8_t sector(uint32_t argument) const {
    const uint32_t number = high_capacity ? argument : argument >> 9;
    return static_cast<uint8_t>((number - base) % kSectors);
  }

  // 2 GB with blocks of 1024 bytes (version 1), or 8 GB (version 2).
  void make_csd() {
    memset(csd_, 0, sizeof(csd_));
    if (csd != nullptr) {
      memcpy(csd_, csd, sizeof(csd_));
      return;
    }
    if (high_capacity) {
      csd_[0] = 0x40;
      csd_[8] = 0x3B;
      csd_[9] = 0x37;  // C_SIZE 0x3B37: 15160 * 1024 sectors
    } else {
      csd_[5] = 0x5A;
      csd_[6] = 0x03;
      csd_[7] = 0xB9;
      csd_[8] = 0xC0;  // C_SIZE 3815
      csd_[9] = 0x03;
      csd_[10] = 0x80;  // C_SIZE_MULT 7
    }
  }

  void take_token(uint8_t out) {
    if (busy_ != 0 || out == 0xFF) {
      return;
    }
    if (many_ && out == 0xFD) {
      ++stopped;
      many_ = false;
      receiving_ = Receiving::kCommand;
      busy_ = busy_bytes;
      queue(0xFF);
      return;
    }
    if (out == (many_ ? 0xFC : 0xFE)) {
      receiving_ = Receiving::kData;
      at_ = 0;
      crc_ = core::kCrc16StartCard;
      return;
    }
    if (out == (0x40 | 12)) {  // the only command that a card takes between blocks
      take_command(out);
      receiving_ = Receiving::kCommand;
    }
  }

  void take_data(uint8_t out) {
    const uint8_t got = at_ == static_cast<uint16_t>(flip_byte) ? out ^ 1 : out;
    crc_ = core::crc16_add(crc_, got);
    if (at_ < 512) {
      incoming_[at_ % 512] = got;
    }
    ++at_;
    if (at_ < 514) {
      return;
    }
    at_ = 0;
    flip_byte = -1;
    receiving_ = many_ ? Receiving::kToken : Receiving::kCommand;
    if (crc_on && crc_ != 0) {
      queue(0b1110'1011);
      return;
    }
    if (write_error) {
      write_error = false;
      queue(0b1110'1101);
      return;
    }
    memcpy(store[sector_], incoming_, 512);
    sector_ = static_cast<uint8_t>((sector_ + 1) % kSectors);
    busy_ = busy_bytes;
    queue(0b1110'0101);
  }

  uint8_t incoming_[512] = {};
  uint8_t replies_[16] = {};
  uint8_t csd_[16] = {};
  uint8_t command_[6] = {};
  const uint8_t* source_ = nullptr;
  uint32_t clock_us_ = 0xFFFFF000U;  // wraps during the start
  uint16_t source_size_ = 0;
  uint16_t sending_ = 0;
  uint16_t busy_ = 0;
  uint16_t at_ = 0;
  uint16_t crc_ = 0;
  uint8_t queued_ = 0;
  uint8_t replied_ = 0;
  uint8_t sector_ = 0;
  Receiving receiving_ = Receiving::kCommand;
  bool selected_ = false;
  bool ever_selected_ = false;
  bool idle_ = true;
  bool application_ = false;
  bool many_ = false;
  bool silent_ = false;
};
