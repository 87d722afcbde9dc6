// Frames waiting for the card: whole frames, one behind the other, in a ring of bytes.
// When it is full the newest frame is dropped and counted; before the next frame that finds room
// (events aside) stands an event `frames_dropped` with the number and the time of the first.
// Between sessions it is closed, takes nothing, and its memory is anybody's.
// Main loop only: no interrupt may touch it.
#pragma once

#include <stdint.h>

#include "generated/frames.h"

namespace core {

class ByteRing {
 public:
  constexpr ByteRing(uint8_t* buffer, uint16_t capacity)
      : buffer_(buffer), capacity_(capacity), free_min_(capacity) {}

  void clear();  // opens it, empties it and forgets all drops
  void close() {
    open_ = false;
    used_ = 0;
  }
  // Its memory, to be asked for at each use; null while it is open.
  uint8_t* lend() { return open_ ? nullptr : buffer_; }

  // `fields` is the packed struct without its id; its size follows from the id.
  bool push(uint8_t id, const void* fields, uint32_t t_us);
  template <typename Frame>
  bool push(const Frame& frame) {
    return push(Frame::id(), &frame, frame.t_us);
  }
  // Events may use the last kEventReserve bytes, which other frames leave free.
  bool push_event(frames::Event code, uint32_t arg, uint32_t t_us);
  // Tells of the frames dropped so far, in the room for events too: at a session's end no frame
  // comes any more that would. True: nothing is left to tell.
  bool tell_dropped();

  uint16_t used() const { return used_; }
  uint16_t free() const { return static_cast<uint16_t>(capacity_ - used_); }
  uint16_t capacity() const { return capacity_; }

  // Bytes of the oldest frames that fit whole into `limit`.
  uint16_t whole(uint16_t limit) const;
  // Longest run of stored bytes from `offset` behind the oldest; at most `limit`.
  const uint8_t* run(uint16_t offset, uint16_t limit, uint16_t& size) const;
  void consume(uint16_t size);  // `size` as `whole` returned it

  uint32_t dropped() const { return dropped_; }  // since clear()
  uint16_t take_free_min();                      // least free room since the last call

 private:
  static constexpr uint16_t kEventReserve = 40;

  void append(const void* data, uint16_t size);
  bool fits(uint8_t id, uint16_t size) const;
  uint8_t at(uint16_t offset) const;

  uint8_t* const buffer_;
  const uint16_t capacity_;
  uint16_t head_ = 0;  // oldest byte
  uint16_t used_ = 0;
  uint16_t free_min_;
  bool open_ = true;
  uint16_t dropped_pending_ = 0;  // not yet told by an event
  uint32_t dropped_first_us_ = 0;
  uint32_t dropped_ = 0;
};

}  // namespace core
