#include "app/usb_channels.h"

#include "core/envelope.h"
#include "hal/serial.h"

namespace app {

namespace {

constexpr uint8_t kIdentBytes = sizeof(frames::IdentFrame) + 1 + core::kEnvelopeOverhead;

// In steps of 1.024 ms, from the instant of the last frame; its scan takes five of them.
constexpr uint16_t kLeastMs = 46;  // 50 ms less 3, because a trigger has jitter
// Of the 50 ms between two envelopes the first takes 6 and a line of 300 bytes 27.
constexpr uint16_t kBehindMs = 16;
constexpr uint16_t kSilentMs = 70;  // no frame comes: the line does not wait for one

uint16_t to_ms(uint32_t now_us) {
  return static_cast<uint16_t>(now_us >> 10);
}

void send(uint8_t id, const void* fields, uint8_t size) {
  core::send_envelope(
      [](const uint8_t* bytes, uint8_t count) { hal::send_bytes(hal::Port::kUsb, bytes, count); },
      id,
      fields,
      size);
}

}  // namespace

void UsbChannels::offer(const frames::IdentFrame& frame) {
  if (!allowed_) return;
  const uint16_t now_ms = to_ms(frame.t_us);
  if (static_cast<uint16_t>(now_ms - sent_ms_) < kLeastMs) return;
  if (hal::send_room(hal::Port::kUsb) < kIdentBytes) return;
  send(frames::IdentFrame::id(), &frame, sizeof frame);
  sent_ms_ = now_ms;
}

bool UsbChannels::begin_line(uint32_t now_us) {
  const uint16_t since_ms = static_cast<uint16_t>(to_ms(now_us) - sent_ms_);
  if (!allowed_ || (since_ms > kBehindMs && since_ms < kSilentMs)) return false;
  const uint32_t hash = frames::kSchemaHash;
  send(0, &hash, sizeof hash);
  return true;
}

}  // namespace app
