// u-blox 6 to 8 on a UART: u-blox 6 Receiver Description GPS.G6-SW-10018, chapter 24 (UBX-CFG).
#pragma once

#include <stdint.h>

#include "core/progmem.h"

namespace drivers {

namespace ublox {
constexpr uint32_t kBaud = 38400;  // 0.2 % off at 16 MHz; 5 Hz need 8.2 kbit/s
// Where a receiver may be found: configured before, as delivered, by other autopilots.
constexpr uint8_t kBauds = 6;
constexpr uint16_t kBaudsPer100[kBauds] CORE_FLASH = {384, 96, 576, 1152, 192, 48};

struct Message {
  uint8_t message_class;
  uint8_t id;
  uint8_t size;
  uint8_t payload[8];
};
// CFG-RATE 200 ms; CFG-MSG: POSLLH, SOL, VELNED, PVT once per epoch (a receiver refuses what it
// does not know); CFG-NAV5 dynamic model 8, airborne below 4 g.
constexpr uint8_t kMessages = 6;
constexpr Message kSetup[kMessages] CORE_FLASH = {
    {0x06, 0x08, 6, {200, 0, 1, 0, 1}},
    {0x06, 0x01, 3, {0x01, 0x02, 1}},
    {0x06, 0x01, 3, {0x01, 0x06, 1}},
    {0x06, 0x01, 3, {0x01, 0x12, 1}},
    {0x06, 0x01, 3, {0x01, 0x07, 1}},
    {0x06, 0x24, 36, {0x01, 0, 8}},
};
// CFG-PRT: UART 1, 8N1, UBX and NMEA in, UBX only out.
constexpr uint8_t kPortSize = 20;
constexpr uint8_t kPort[kPortSize] CORE_FLASH = {
    1,     0, 0,     0, 0xD0, 0x08, 0, 0, kBaud & 0xFF, kBaud >> 8 & 0xFF, kBaud >> 16, 0,
    0b011, 0, 0b001, 0, 0,    0,    0, 0};
}  // namespace ublox

// Finds the baud, moves the receiver to 38400, switches it to UBX at 5 Hz; starts over when it
// falls silent. Never waits.
// Port: void set_baud(uint32_t), bool send(const uint8_t*, uint8_t) whole or not at all; messages
// are handed to it byte by byte, so that neither side needs room for one.
template <typename Port>
class Ublox {
 public:
  static constexpr uint32_t kSettleUs = 150000UL;   // 28 bytes at 4800 baud, and some
  static constexpr uint32_t kListenUs = 1300000UL;  // a receiver just powered answers within 1 s
  static constexpr uint32_t kSilentUs = 5000000UL;

  explicit Ublox(Port& port) : port_(port) {}

  // `messages`: good ones counted so far by the parser.
  void poll(uint16_t messages, uint32_t now_us) {
    if (messages != messages_) {
      messages_ = messages;
      heard_us_ = now_us;
      heard_ = true;
    }
    switch (step_) {
      case Step::kTry:
        port_.set_baud(static_cast<uint32_t>(core::flash_u16(&ublox::kBaudsPer100[baud_])) * 100);
        next(Step::kPort, now_us);
        return;
      case Step::kPort:
        if (send_port()) {
          next(Step::kSettle, now_us);
        }
        return;
      case Step::kSettle:
        if (now_us - since_us_ >= kSettleUs) {
          port_.set_baud(ublox::kBaud);
          message_ = 0;
          heard_ = false;
          next(Step::kSetup, now_us);
        }
        return;
      case Step::kSetup:
        if (message_ == ublox::kMessages) {
          next(Step::kListen, now_us);
        } else if (send_setup()) {
          ++message_;
        }
        return;
      case Step::kListen:
        if (heard_) {
          next(Step::kFound, now_us);
        } else if (now_us - since_us_ >= kListenUs) {
          baud_ = static_cast<uint8_t>(baud_ + 1 == ublox::kBauds ? 0 : baud_ + 1);
          next(Step::kTry, now_us);
        }
        return;
      case Step::kFound:
        if (now_us - heard_us_ >= kSilentUs) {
          baud_ = 0;
          next(Step::kTry, now_us);
        }
        return;
    }
  }
  bool found() const { return step_ == Step::kFound; }

 private:
  enum class Step : uint8_t { kTry, kPort, kSettle, kSetup, kListen, kFound };

  void next(Step step, uint32_t now_us) {
    step_ = step;
    since_us_ = now_us;
  }

  bool send_port() { return send(0x06, 0x00, ublox::kPortSize, ublox::kPort, ublox::kPortSize); }

  bool send_setup() {
    const ublox::Message& setup = ublox::kSetup[message_];
    return send(core::flash_u8(&setup.message_class),
                core::flash_u8(&setup.id),
                core::flash_u8(&setup.size),
                setup.payload,
                sizeof(setup.payload));
  }

  // Goes on with a message as far as the port takes it; true at its end. `payload` lies in program
  // memory; what it is too short for is 0.
  bool send(
      uint8_t message_class, uint8_t id, uint8_t size, const uint8_t* payload, uint8_t given) {
    const uint8_t head[] = {0xB5, 0x62, message_class, id, size, 0};
    for (;;) {
      const uint8_t sums_at = static_cast<uint8_t>(size + sizeof(head));
      uint8_t byte = 0;
      if (at_ < sizeof(head)) {
        byte = head[at_];
      } else if (at_ < sums_at) {
        const uint8_t index = static_cast<uint8_t>(at_ - sizeof(head));
        byte = index < given ? core::flash_u8(payload + index) : uint8_t{0};
      } else {
        byte = at_ == sums_at ? sum_a_ : sum_b_;
      }
      if (!port_.send(&byte, 1)) {
        return false;
      }
      if (at_ < 2) {
        sum_a_ = 0;
        sum_b_ = 0;
      } else if (at_ < sums_at) {
        sum_a_ = static_cast<uint8_t>(sum_a_ + byte);
        sum_b_ = static_cast<uint8_t>(sum_b_ + sum_a_);
      }
      ++at_;
      if (at_ == sums_at + 2) {
        at_ = 0;
        return true;
      }
    }
  }

  Port& port_;
  uint32_t since_us_ = 0;
  uint32_t heard_us_ = 0;
  uint16_t messages_ = 0;
  uint8_t baud_ = 0;
  uint8_t message_ = 0;
  uint8_t at_ = 0;  // byte of the message under way
  uint8_t sum_a_ = 0;
  uint8_t sum_b_ = 0;
  Step step_ = Step::kTry;
  bool heard_ = false;
};

}  // namespace drivers
