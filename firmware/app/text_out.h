// Text to a serial port, without waiting and without buffers of its own.
#pragma once

#include <stdint.h>

#include "hal/serial.h"

namespace app {

class TextOut {
 public:
  explicit TextOut(hal::Port port) : port_(port) {}

  uint16_t room() const { return hal::send_room(port_); }
  // `flash` lies in program memory.
  void flash(const char* flash);
  void number(int32_t value);
  // value / 10^places, with that many digits behind the point.
  void fixed(int32_t value, uint8_t places);
  void hex(uint32_t value);  // eight digits
  void letter(char value) { hal::send_byte(port_, static_cast<uint8_t>(value)); }

 private:
  hal::Port port_;
};

}  // namespace app
