// The buses that drivers/mpu6000.h and drivers/hmc5883l.h ask for, on the hal.
#pragma once

#include <stdint.h>

namespace imu {

// Registers of an MPU-6000 over SPI, or of an MPU-6050 over the bus to the Mega.
class MpuBus {
 public:
  bool read(uint8_t reg, uint8_t* out, uint8_t size);
  bool write(uint8_t reg, uint8_t value);
  bool spi() const { return spi_; }
  void try_the_other() { spi_ = !spi_; }

 private:
  bool spi_ = true;
};

// Registers of the magnetometer, over the bus to the Mega.
struct MagBus {
  bool read(uint8_t address, uint8_t reg, uint8_t* out, uint8_t size);
  bool write(uint8_t address, uint8_t reg, uint8_t value);
};

}  // namespace imu
