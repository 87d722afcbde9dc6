#include "core/ubx.h"

#include <string.h>

namespace core {
namespace {

constexpr uint8_t kSync0 = 0xB5;
constexpr uint8_t kSync1 = 0x62;

enum State : uint8_t {
  kWait,
  kSecondSync,
  kClass,
  kId,
  kLengthLow,
  kLengthHigh,
  kPayload,
  kSumA,
  kSumB
};

}  // namespace

void UbxParser::sum(uint8_t value) {
  sum_a_ = static_cast<uint8_t>(sum_a_ + value);
  sum_b_ = static_cast<uint8_t>(sum_b_ + sum_a_);
}

UbxEvent UbxParser::fail(uint8_t value, uint32_t now_us) {
  first_byte_us_ = now_us;
  state_ = value == kSync0 ? kSecondSync : kWait;
  return UbxEvent::kError;
}

UbxEvent UbxParser::byte(uint8_t value, uint32_t now_us) {
  switch (static_cast<State>(state_)) {
    case kWait:
      if (value == kSync0) {
        first_byte_us_ = now_us;
        state_ = kSecondSync;
      }
      break;
    case kSecondSync:
      if (value == kSync1) {
        sum_a_ = 0;
        sum_b_ = 0;
        state_ = kClass;
      } else if (value == kSync0) {
        first_byte_us_ = now_us;
      } else {
        state_ = kWait;
      }
      break;
    case kClass:
      class_ = value;
      sum(value);
      state_ = kId;
      break;
    case kId:
      id_ = value;
      sum(value);
      state_ = kLengthLow;
      break;
    case kLengthLow:
      length_ = value;
      sum(value);
      state_ = kLengthHigh;
      break;
    case kLengthHigh:
      length_ = static_cast<uint16_t>(length_ | static_cast<uint16_t>(value) << 8);
      sum(value);
      if (length_ > kMaxLength) {
        return fail(value, now_us);
      }
      at_ = 0;
      state_ = length_ == 0 ? kSumA : kPayload;
      break;
    case kPayload:
      word_ = word_ >> 8 | static_cast<uint32_t>(value) << 24;
      sum(value);
      ++at_;
      if (at_ == length_) {
        state_ = kSumA;
      }
      return at_ % 4 == 0 ? UbxEvent::kWord : UbxEvent::kNone;
    case kSumA:
      if (value != sum_a_) {
        return fail(value, now_us);
      }
      state_ = kSumB;
      break;
    case kSumB:
      if (value != sum_b_) {
        return fail(value, now_us);
      }
      state_ = kWait;
      return UbxEvent::kMessage;
  }
  return UbxEvent::kNone;
}

uint8_t put_ubx(
    uint8_t* to, uint8_t message_class, uint8_t id, const uint8_t* payload, uint8_t size) {
  to[0] = kSync0;
  to[1] = kSync1;
  to[2] = message_class;
  to[3] = id;
  to[4] = size;
  to[5] = 0;
  memcpy(to + 6, payload, size);
  uint8_t sum_a = 0;
  uint8_t sum_b = 0;
  for (uint8_t i = 2; i < size + 6; ++i) {
    sum_a = static_cast<uint8_t>(sum_a + to[i]);
    sum_b = static_cast<uint8_t>(sum_b + sum_a);
  }
  to[size + 6] = sum_a;
  to[size + 7] = sum_b;
  return static_cast<uint8_t>(size + 8);
}

}  // namespace core
