// Bytes of a u-blox receiver in, one frame `gps` per navigation epoch out: POSLLH, SOL and VELNED
// of the same time of week (u-blox 6), or NAV-PVT alone (7 and later). STATUS is heard only.
#pragma once

#include <stdint.h>

#include "core/ubx.h"
#include "generated/frames.h"

namespace core {

class GpsReceiver {
 public:
  // True: `frame` holds a whole epoch, until the next byte; `fix`, `satellites` and `ground_speed`
  // until the next epoch has its own.
  bool byte(uint8_t value, uint32_t now_us);

  const frames::GpsFrame& frame() const { return frame_; }
  // For positions that do not come through this port: there is one latest, whoever gave it.
  frames::GpsFrame& other_source() { return frame_; }
  uint16_t errors() const { return errors_; }
  uint16_t messages() const { return messages_; }  // good ones of any kind: the baud is right

 private:
  void word(uint8_t offset, uint32_t value);
  void posllh(uint8_t offset, uint32_t value);
  void sol(uint8_t offset, uint32_t value);
  void velned(uint8_t offset, uint32_t value);
  void pvt(uint8_t offset, uint32_t value);
  void begin_epoch(uint32_t itow_ms);
  bool message();
  void finish();

  // Fields go straight into the frame as they arrive; a message that fails ends its epoch.
  UbxParser parser_;
  frames::GpsFrame frame_ = {};
  uint32_t epoch_ms_ = 0;
  uint16_t errors_ = 0;
  uint16_t messages_ = 0;
  uint16_t days_ = 0;  // of NAV-PVT's date since 1980-01-06
  uint8_t parts_ = 0;  // messages of this epoch
  bool time_known_ = false;
  bool sends_pvt_ = false;
};

// Everything of a frame that has an invalid value gets it; the rest is 0.
void clear_gps(frames::GpsFrame& frame);

// Date and time as a FAT holds them (two-second steps, UTC by 18 leap seconds); 0 if not known.
uint32_t fat_time(uint16_t week, uint32_t itow_ms);

}  // namespace core
