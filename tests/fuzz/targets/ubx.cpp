// A GPS line with anything on it: an epoch is given out only behind a message whose checksum is
// right, its fields are such as the frame may hold, and a good receiver is heard again at once.
#include "core/gps_receiver.h"
#include "feed.h"

namespace {

constexpr uint8_t kRoom = 120;
constexpr uint8_t kNav = 0x01;
constexpr uint8_t kIds[] = {0x02, 0x03, 0x06, 0x07, 0x12, 0x30};
constexpr uint8_t kLengths[] = {28, 16, 52, 92, 36, 8};

struct Line {
  core::GpsReceiver receiver;
  uint32_t now_us = 0;
  uint16_t epochs = 0;

  void byte(uint8_t value) {
    const uint16_t messages = receiver.messages();
    now_us += 260;
    if (!receiver.byte(value, now_us)) return;
    ++epochs;
    ALWAYS(receiver.messages() == static_cast<uint16_t>(messages + 1));
    const frames::GpsFrame& frame = receiver.frame();
    ALWAYS(frame.fix <= 5);
    ALWAYS(frame.source == static_cast<uint8_t>(frames::GpsSource::kUbx));
    ALWAYS(static_cast<int32_t>(now_us - frame.t_us) >= 0);
    const uint32_t when = core::fat_time(frame.week, frame.itow_ms);
    const uint32_t month = when >> 21 & 0x0F;
    const uint32_t day = when >> 16 & 0x1F;
    ALWAYS(when == 0 || (month >= 1 && month <= 12 && day >= 1));
    ALWAYS((when >> 11 & 0x1F) < 24 && (when >> 5 & 0x3F) < 60 && (when & 0x1F) < 30);
  }
};

}  // namespace

int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  Feed feed(bytes, size);
  Line line;
  while (feed.more()) {
    const uint8_t what = feed.u8();
    if ((what & 0x80) == 0) {  // noise
      for (uint8_t left = what & 0x0F; left != 0; --left) line.byte(feed.u8());
      continue;
    }
    uint8_t payload[kRoom] = {};
    uint8_t message[kRoom + 8];
    const uint8_t kind = what & 0x07;
    const bool known = kind < sizeof kIds;
    const uint8_t id = known ? kIds[kind] : feed.u8();
    uint8_t length = known ? kLengths[kind] : uint8_t(feed.u8() % kRoom);
    if ((what & 0x18) == 0x18) length = uint8_t(feed.u8() % kRoom);
    feed.fill(payload, length);
    uint8_t whole = core::put_ubx(message, kNav, id, payload, length);
    if ((what & 0x60) == 0x60) {  // damaged or cut
      whole = uint8_t(feed.u8() % (whole + 1));
      message[feed.u8() % (length + 8)] ^= feed.u8();
    }
    for (uint8_t i = 0; i < whole; ++i) line.byte(message[i]);
  }
  // What is half read is at most a message of 512 bytes; behind it a good one is heard.
  for (uint16_t i = 0; i < 530; ++i) line.byte(0);
  const uint16_t messages = line.receiver.messages();
  uint8_t message[8 + 8];
  const uint8_t payload[8] = {};
  const uint8_t whole = core::put_ubx(message, kNav, 0x30, payload, sizeof payload);
  for (uint8_t i = 0; i < whole; ++i) line.byte(message[i]);
  ALWAYS(line.receiver.messages() == static_cast<uint16_t>(messages + 1));
  return 0;
}
