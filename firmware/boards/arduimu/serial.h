// The UART: a GPS receiver in flight, the console on the ground.
#pragma once

#include <stdint.h>

namespace arduimu {

// What drivers/ublox.h asks of a port.
struct SerialPort {
  void set_baud(uint32_t baud);
  bool send(const uint8_t* bytes, uint8_t size);  // whole or not at all
};

bool take_byte(uint8_t& byte);

}  // namespace arduimu
