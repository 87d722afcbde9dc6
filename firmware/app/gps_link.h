// The port that drivers/ublox.h asks for, on hal/serial.h.
#pragma once

#include <stdint.h>

#include "hal/serial.h"

namespace app {

class GpsLink {
 public:
  void set_baud(uint32_t baud) { hal::open_port(hal::Port::kGps, baud); }

  bool send(const uint8_t* bytes, uint8_t size) {
    if (hal::send_room(hal::Port::kGps) < size) return false;
    hal::send_bytes(hal::Port::kGps, bytes, size);
    return true;
  }
};

}  // namespace app
