// u-blox 6 to 8 on a UART: u-blox 6 Receiver Description GPS.G6-SW-10018, chapter 24 (UBX-CFG).
#pragma once

#include <stdint.h>

#include "core/bytes.h"
#include "core/progmem.h"
#include "core/ubx.h"

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
    {0x06, 0x08, 6, {200, 0, 1, 0, 1, 0, 0, 0}},
    {0x06, 0x01, 3, {0x01, 0x02, 1, 0, 0, 0, 0, 0}},
    {0x06, 0x01, 3, {0x01, 0x06, 1, 0, 0, 0, 0, 0}},
    {0x06, 0x01, 3, {0x01, 0x12, 1, 0, 0, 0, 0, 0}},
    {0x06, 0x01, 3, {0x01, 0x07, 1, 0, 0, 0, 0, 0}},
    {0x06, 0x24, 36, {0x01, 0, 8, 0, 0, 0, 0, 0}},
};
}  // namespace ublox

// Finds the baud, moves the receiver to 38400, switches it to UBX at 5 Hz; starts over when it
// falls silent. Never waits.
// Port: void set_baud(uint32_t), bool send(const uint8_t*, uint8_t) whole or not at all
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
        port_.set_baud(static_cast<uint32_t>(core::flash_load(&ublox::kBaudsPer100[baud_])) * 100);
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

  // CFG-PRT: UART 1, 8N1, 38400 baud, UBX and NMEA in, UBX only out.
  bool send_port() {
    uint8_t payload[20] = {1, 0, 0, 0, 0xD0, 0x08};
    core::put_le(payload + 8, ublox::kBaud);
    payload[12] = 0b011;
    payload[14] = 0b001;
    uint8_t message[28];
    return port_.send(message, core::put_ubx(message, 0x06, 0x00, payload, 20));
  }

  bool send_setup() {
    const ublox::Message setup = core::flash_load(&ublox::kSetup[message_]);
    uint8_t payload[36] = {};
    memcpy(payload, setup.payload, sizeof(setup.payload));
    uint8_t message[44];
    return port_.send(message,
                      core::put_ubx(message, setup.message_class, setup.id, payload, setup.size));
  }

  Port& port_;
  uint32_t since_us_ = 0;
  uint32_t heard_us_ = 0;
  uint16_t messages_ = 0;
  uint8_t baud_ = 0;
  uint8_t message_ = 0;
  Step step_ = Step::kTry;
  bool heard_ = false;
};

}  // namespace drivers
