// The port that drivers/ublox.h asks for, and the console's lines, on hal/serial.h.
#pragma once

#include <stdint.h>

#include "core/imu/answer.h"
#include "hal/serial.h"

namespace imu {

class SerialLink {
 public:
  void set_baud(uint32_t baud) { hal::open_port(hal::Port::kGps, baud); }

  // Whole or not at all.
  bool send(const uint8_t* bytes, uint8_t size) {
    if (hal::send_room(hal::Port::kGps) < size) {
      return false;
    }
    for (uint8_t i = 0; i < size; ++i) {
      hal::send_byte(hal::Port::kGps, bytes[i]);
    }
    return true;
  }
  // A line for which there is no room is left out: who asked asks again.
  void print(const core::TextLine& line) { static_cast<void>(send(line.bytes(), line.size())); }

  bool take(uint8_t& byte) { return hal::take_byte(hal::Port::kGps, &byte); }
};

}  // namespace imu
