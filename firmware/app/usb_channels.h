// USB while nothing is recorded: the channels in envelopes, 20 a second, between whole status
// lines. Nothing is ever read from it.
#pragma once

#include <stdint.h>

#include "generated/frames.h"

namespace app {

class UsbChannels {
 public:
  // False while a session is recorded or a line is under way: no envelope begins.
  void allow(bool allowed) { allowed_ = allowed; }

  // Sends the frame if it is its turn.
  void offer(const frames::IdentFrame& frame);
  // True if a line that begins now is over before the next envelope is due. Then the schema's hash
  // goes out before it, 10 B for which the caller found room: whoever opened the port just now
  // learns what the envelopes mean.
  bool begin_line(uint32_t now_us);

 private:
  uint16_t sent_ms_ = 0;  // instant of the last frame sent, in steps of 1.024 ms
  bool allowed_ = false;
};

}  // namespace app
