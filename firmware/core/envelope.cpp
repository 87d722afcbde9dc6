#include "core/envelope.h"

#include <string.h>

#include "core/bytes.h"
#include "core/crc.h"

namespace core {

uint8_t put_envelope(uint8_t* to, uint8_t id, const void* fields, uint8_t size) {
  if (size >= kEnvelopeMaxFrame) {
    return 0;
  }
  to[0] = kEnvelopeSync0;
  to[1] = kEnvelopeSync1;
  to[2] = static_cast<uint8_t>(size + 1);
  to[3] = id;
  memcpy(to + 4, fields, size);
  put_le(to + 4 + size, crc16(kCrc16Start, to + 2, static_cast<uint16_t>(size + 2)));
  return static_cast<uint8_t>(size + 6);
}

bool EnvelopeDecoder::byte(uint8_t value) {
  if (done_ != 0) {
    // Whoever did not ask for `next` gives up what it would have said.
    while (next()) {
    }
  }
  buffer_[filled_++] = value;
  return next();
}

bool EnvelopeDecoder::next() {
  if (done_ != 0) {
    drop(done_);
    done_ = 0;
  }
  while (filled_ != 0) {
    const bool sync = buffer_[0] == kEnvelopeSync0 && (filled_ < 2 || buffer_[1] == kEnvelopeSync1);
    if (!sync) {
      ++skipped_;
      drop(1);
      continue;
    }
    if (filled_ < 3) {
      return false;
    }
    const uint8_t size = buffer_[2];
    bool bad = size == 0 || size > kEnvelopeMaxFrame;
    if (!bad) {
      if (filled_ < size + kEnvelopeOverhead) {
        return false;
      }
      bad = crc16(kCrc16Start, buffer_ + 2, static_cast<uint16_t>(size + 1)) !=
            get_le<uint16_t>(buffer_ + 3 + size);
    }
    if (!bad) {
      done_ = static_cast<uint8_t>(size + kEnvelopeOverhead);
      return true;
    }
    ++failed_;
    ++skipped_;
    drop(1);
  }
  return false;
}

uint8_t EnvelopeDecoder::pending() const {
  return static_cast<uint8_t>(filled_ - done_);
}

void EnvelopeDecoder::drop(uint8_t count) {
  filled_ = static_cast<uint8_t>(filled_ - count);
  memmove(buffer_, buffer_ + count, filled_);
}

}  // namespace core
