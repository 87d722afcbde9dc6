// u-blox binary messages: byte-wise parser and builder (u-blox 6 receiver description, chapter 22).
#pragma once

#include <stdint.h>

namespace core {

enum class UbxEvent : uint8_t {
  kNone,
  kWord,     // four more bytes of payload: `word` and `offset`; not yet to be trusted
  kMessage,  // the checksum is right
  kError     // a checksum failed or a length was refused: forget the words
};

// Keeps no payload: every field of the messages that are used is a part of an aligned word.
class UbxParser {
 public:
  UbxEvent byte(uint8_t value, uint32_t now_us);

  uint8_t message_class() const { return class_; }
  uint8_t message_id() const { return id_; }
  uint16_t length() const { return length_; }
  uint32_t word() const { return word_; }
  uint16_t offset() const { return static_cast<uint16_t>(at_ - 4); }  // of `word`
  uint32_t first_byte_us() const { return first_byte_us_; }

 private:
  static constexpr uint16_t kMaxLength = 512;

  void sum(uint8_t value);
  UbxEvent fail(uint8_t value, uint32_t now_us);

  uint32_t first_byte_us_ = 0;
  uint32_t word_ = 0;
  uint16_t length_ = 0;
  uint16_t at_ = 0;
  uint8_t class_ = 0;
  uint8_t id_ = 0;
  uint8_t state_ = 0;
  uint8_t sum_a_ = 0;
  uint8_t sum_b_ = 0;
};

// Writes a whole message (payload + 8 bytes) and returns its size.
uint8_t put_ubx(
    uint8_t* to, uint8_t message_class, uint8_t id, const uint8_t* payload, uint8_t size);

}  // namespace core
