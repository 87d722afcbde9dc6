// u-blox binary messages: byte-wise parser and builder (u-blox 6 receiver description, chapter 22).
#pragma once

#include <stdint.h>

namespace core {

enum class UbxEvent : uint8_t { kNone, kMessage, kError };

class UbxParser {
 public:
  static constexpr uint8_t kKeep = 72;  // NAV-PVT up to sAcc; longer payloads are summed, not kept

  // kMessage: a good message stands in the accessors until the next byte.
  // kError: a checksum failed or a length was refused.
  UbxEvent byte(uint8_t value, uint32_t now_us);

  uint8_t message_class() const { return class_; }
  uint8_t message_id() const { return id_; }
  uint16_t length() const { return length_; }
  const uint8_t* payload() const { return payload_; }
  uint32_t first_byte_us() const { return first_byte_us_; }

 private:
  static constexpr uint16_t kMaxLength = 512;

  void sum(uint8_t value);
  UbxEvent fail(uint8_t value, uint32_t now_us);

  uint32_t first_byte_us_ = 0;
  uint16_t length_ = 0;
  uint16_t at_ = 0;
  uint8_t class_ = 0;
  uint8_t id_ = 0;
  uint8_t state_ = 0;
  uint8_t sum_a_ = 0;
  uint8_t sum_b_ = 0;
  uint8_t payload_[kKeep] = {};
};

// Writes a whole message (payload + 8 bytes) and returns its size.
uint8_t put_ubx(
    uint8_t* to, uint8_t message_class, uint8_t id, const uint8_t* payload, uint8_t size);

}  // namespace core
