// Telemetry envelope of protocol/README.md: A5 5A, length, frame, CRC-16 over length and frame.
#pragma once

#include <stdint.h>

#include "core/crc.h"

namespace core {

constexpr uint8_t kEnvelopeOverhead = 5;
constexpr uint8_t kEnvelopeMaxFrame = 128;
constexpr uint8_t kEnvelopeSync0 = 0xA5;
constexpr uint8_t kEnvelopeSync1 = 0x5A;

// Writes the envelope of a frame (`id` and its fields) and returns its size; 0 if the frame is
// longer than 128 bytes. `to` holds size + 6 bytes.
uint8_t put_envelope(uint8_t* to, uint8_t id, const void* fields, uint8_t size);

// The same in pieces to `put(const uint8_t*, uint8_t)`, without room for it; `size` below
// kEnvelopeMaxFrame.
template <typename Put>
void send_envelope(Put put, uint8_t id, const void* fields, uint8_t size) {
  const uint8_t head[] = {kEnvelopeSync0, kEnvelopeSync1, static_cast<uint8_t>(size + 1), id};
  const uint8_t* const bytes = static_cast<const uint8_t*>(fields);
  const uint16_t crc = crc16(crc16(kCrc16Start, head + 2, 2), bytes, size);
  const uint8_t tail[] = {static_cast<uint8_t>(crc & 0xFFU), static_cast<uint8_t>(crc >> 8)};
  put(head, uint8_t{sizeof head});
  put(bytes, size);
  put(tail, uint8_t{sizeof tail});
}

// Feed it every received byte; `frame` is good until the next call of `byte`.
class EnvelopeDecoder {
 public:
  // True when this byte made a frame known. Several frames may come out of one byte, after a
  // failed envelope: call `next` until it is false.
  bool byte(uint8_t value);
  bool next();

  const uint8_t* frame() const { return buffer_ + 3; }  // id and fields
  uint8_t frame_size() const { return buffer_[2]; }
  uint16_t failed() const { return failed_; }    // syncs followed by a bad length or CRC
  uint32_t skipped() const { return skipped_; }  // bytes in no good envelope
  uint8_t pending() const;                       // bytes that may still become an envelope

 private:
  void drop(uint8_t count);

  uint8_t buffer_[kEnvelopeMaxFrame + kEnvelopeOverhead] = {};
  uint8_t filled_ = 0;
  uint8_t done_ = 0;  // size of the envelope that `frame` shows, to be dropped
  uint16_t failed_ = 0;
  uint32_t skipped_ = 0;
};

}  // namespace core
