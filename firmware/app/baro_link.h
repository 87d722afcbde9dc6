// The bus that drivers/barometer.h asks for, on hal/baro_bus.h.
#pragma once

#include <stdint.h>
#include <string.h>

#include "drivers/soft_i2c.h"
#include "hal/baro_bus.h"

namespace app {

class BaroLink {
 public:
  bool start(uint8_t address, uint8_t* buffer, uint8_t out_size, uint8_t in_size, uint32_t) {
    buffer_ = buffer;
    in_size_ = in_size;
    if (out_size == 2) {
      hal::baro_bus_write(address, buffer[0], buffer[1]);
    } else {
      hal::baro_bus_read(address, buffer[0], in_size);
    }
    return true;
  }

  drivers::BusStatus poll(uint32_t) {
    switch (hal::step_baro_bus()) {
      case hal::BusStatus::kBusy:
        return drivers::BusStatus::kBusy;
      case hal::BusStatus::kNoAck:
        return drivers::BusStatus::kNack;
      case hal::BusStatus::kStuck:
        return drivers::BusStatus::kStuck;
      case hal::BusStatus::kDone:
        break;
    }
    if (in_size_ > 0) memcpy(buffer_, hal::baro_bus_bytes(), in_size_);
    return drivers::BusStatus::kDone;
  }

 private:
  uint8_t* buffer_ = nullptr;
  uint8_t in_size_ = 0;
};

}  // namespace app
