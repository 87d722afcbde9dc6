#include "core/byte_ring.h"

namespace core {
namespace {

// Four at once: 5 cycles a byte on the AVR, where memcpy takes 8.
void copy(uint8_t* to, const uint8_t* from, uint16_t size) {
  uint8_t fours = static_cast<uint8_t>(size / 4U);
  for (; fours != 0; --fours) {
    *to++ = *from++;
    *to++ = *from++;
    *to++ = *from++;
    *to++ = *from++;
  }
  for (uint8_t rest = size & 3U; rest != 0; --rest) {
    *to++ = *from++;
  }
}

}  // namespace

void ByteRing::clear() {
  open_ = true;
  head_ = 0;
  used_ = 0;
  free_min_ = capacity_;
  dropped_pending_ = 0;
  dropped_ = 0;
}

bool ByteRing::fits(uint8_t id, uint16_t size) const {
  const uint16_t reserve = id == frames::kEventId ? 0 : kEventReserve;
  return static_cast<uint16_t>(size + reserve) <= free();
}

bool ByteRing::push(uint8_t id, const void* fields, uint32_t t_us) {
  if (!open_) {
    return false;
  }
  const uint8_t size = frames::wire_size(id);
  // An event squeezed into the reserve does not mean that there is room again.
  const bool tells = dropped_pending_ != 0 && id != frames::kEventId;
  const uint8_t notice = tells ? frames::kEventWireSize : 0;
  // Small frames do not slip in between large ones that are dropped: there is room again when the
  // identification frame has some, and one event tells of all.
  const uint8_t wanted = tells && size < frames::kIdentWireSize ? frames::kIdentWireSize : size;
  if (size == 0 || !fits(id, static_cast<uint16_t>(wanted + notice))) {
    if (dropped_pending_ == 0) {
      dropped_first_us_ = t_us;
    }
    if (dropped_pending_ != 0xFFFF) {
      ++dropped_pending_;
    }
    ++dropped_;
    return false;
  }
  if (notice != 0) {
    (void)tell_dropped();
  }
  append(&id, 1);
  append(fields, static_cast<uint16_t>(size - 1));
  if (free() < free_min_) {
    free_min_ = free();
  }
  return true;
}

bool ByteRing::tell_dropped() {
  if (dropped_pending_ == 0 || !open_) {
    return true;
  }
  if (free() < frames::kEventWireSize) {
    return false;
  }
  frames::EventFrame event;
  event.t_us = dropped_first_us_;
  event.code = static_cast<uint8_t>(frames::Event::kFramesDropped);
  event.arg = dropped_pending_;
  dropped_pending_ = 0;
  const uint8_t id = frames::kEventId;
  append(&id, 1);
  append(&event, sizeof(event));
  return true;
}

bool ByteRing::push_event(frames::Event code, uint32_t arg, uint32_t t_us) {
  frames::EventFrame event;
  event.t_us = t_us;
  event.code = static_cast<uint8_t>(code);
  event.arg = arg;
  return push(event);
}

void ByteRing::append(const void* data, uint16_t size) {
  uint16_t at = static_cast<uint16_t>(head_ + used_);
  if (at >= capacity_) {
    at = static_cast<uint16_t>(at - capacity_);
  }
  const uint16_t to_end = static_cast<uint16_t>(capacity_ - at);
  const uint16_t first = size < to_end ? size : to_end;
  const uint8_t* const bytes = static_cast<const uint8_t*>(data);
  copy(buffer_ + at, bytes, first);
  if (first < size) {
    copy(buffer_, bytes + first, static_cast<uint16_t>(size - first));
  }
  used_ = static_cast<uint16_t>(used_ + size);
}

uint8_t ByteRing::at(uint16_t offset) const {
  const uint16_t index = static_cast<uint16_t>(head_ + offset);
  return buffer_[index < capacity_ ? index : static_cast<uint16_t>(index - capacity_)];
}

uint16_t ByteRing::whole(uint16_t limit) const {
  uint16_t size = 0;
  while (size < used_) {
    const uint16_t next = static_cast<uint16_t>(size + frames::wire_size(at(size)));
    if (next > limit) {
      break;
    }
    size = next;
  }
  return size;
}

const uint8_t* ByteRing::run(uint16_t offset, uint16_t limit, uint16_t& size) const {
  uint16_t at = static_cast<uint16_t>(head_ + offset);
  if (at >= capacity_) {
    at = static_cast<uint16_t>(at - capacity_);
  }
  const uint16_t to_end = static_cast<uint16_t>(capacity_ - at);
  size = limit < to_end ? limit : to_end;
  return buffer_ + at;
}

void ByteRing::consume(uint16_t size) {
  head_ = static_cast<uint16_t>(head_ + size);
  if (head_ >= capacity_) {
    head_ = static_cast<uint16_t>(head_ - capacity_);
  }
  used_ = static_cast<uint16_t>(used_ - size);
}

uint16_t ByteRing::take_free_min() {
  const uint16_t least = free_min_;
  free_min_ = free();
  return least;
}

}  // namespace core
