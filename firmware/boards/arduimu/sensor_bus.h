// Registers of the MPU-6000 over SPI, or of an MPU-6050 over the bus to the Mega; and of the
// magnetometer over that bus.
#pragma once

#include <stdint.h>

namespace arduimu {

class MpuBus {
 public:
  bool read(uint8_t reg, uint8_t* out, uint8_t size);
  bool write(uint8_t reg, uint8_t value);
  bool spi() const { return spi_; }
  void try_the_other() { spi_ = !spi_; }

 private:
  bool spi_ = true;
};

struct MagBus {
  bool read(uint8_t address, uint8_t reg, uint8_t* out, uint8_t size);
  bool write(uint8_t address, uint8_t reg, uint8_t value);
};

void start_spi();

}  // namespace arduimu
