// A session's blocks on their way to the card: a stream that never waits, and what the card does to
// it. Which file, and when a session starts and ends, is the recorder's.
#pragma once

#include <stdint.h>

#include "app/outlet.h"
#include "core/block_writer.h"
#include "hal/block_device.h"

namespace app {

class CardStream {
 public:
  CardStream(core::BlockWriter& writer, Outlet& outlet) : writer_(writer), outlet_(outlet) {}

  // A session begins; block n of its file stands at `first_lba` + n.
  void start(uint32_t first_lba);
  // Once per turn of the main loop: carries the block under way on. Anything but kOk: the card is
  // gone, busy for ever, or refuses every block, and the stream is no more.
  hal::CardStatus step(uint32_t now_us);
  // Between two blocks, and the card is not busy with the last.
  bool rests() const { return !block_open_ && !programming_; }
  // Ends the stream once it rests. False while the card is busy with that: it takes no other call.
  bool ended(uint32_t now_us);

  void put_health(frames::SystemFrame* out);

 private:
  // Hands bytes of a block to the card.
  struct Sink {
    void put(const uint8_t* bytes, uint16_t size, core::Crc32& crc) {
      crc.set_state(hal::put_block(bytes, size, crc.state()));
    }
  };

  hal::CardStatus open(uint32_t now_us);
  hal::CardStatus next_block(uint32_t now_us);
  hal::CardStatus close_block(uint32_t now_us);
  hal::CardStatus failed(hal::CardStatus why);
  void count_error();
  void note_busy(uint32_t now_us);
  void tell_stall(uint32_t now_us);

  core::BlockWriter& writer_;
  Outlet& outlet_;
  uint32_t first_lba_ = 0;
  uint32_t busy_from_us_ = 0;  // the card was last seen idle, opened, or given a block
  uint16_t errors_ = 0;
  uint16_t stall_ms_ = 0;  // not yet told by an event
  uint16_t busy_max_ms_ = 0;
  uint8_t rejects_ = 0;
  bool open_ = false;
  bool closing_ = false;
  bool block_open_ = false;
  bool programming_ = false;
};

}  // namespace app
