#include "imu/sensor_bus.h"

#include <string.h>

#include "hal/bus_master.h"
#include "hal/sensor_spi.h"

namespace imu {
namespace {

constexpr uint8_t kMpuAddress = 0x68;  // AD0 low
constexpr uint8_t kBiggest = 16;

bool read_twi(uint8_t address, uint8_t reg, uint8_t* out, uint8_t size) {
  uint8_t buffer[kBiggest];
  buffer[0] = reg;
  if (size > kBiggest || hal::transfer(address, buffer, 1, size) != hal::TransferStatus::kDone) {
    return false;
  }
  memcpy(out, buffer, size);
  return true;
}

bool write_twi(uint8_t address, uint8_t reg, uint8_t value) {
  uint8_t buffer[2] = {reg, value};
  return hal::transfer(address, buffer, 2, 0) == hal::TransferStatus::kDone;
}

}  // namespace

bool MpuBus::read(uint8_t reg, uint8_t* out, uint8_t size) {
  if (!spi_) {
    return read_twi(kMpuAddress, reg, out, size);
  }
  hal::read_sensor(reg, out, size);
  return true;
}

bool MpuBus::write(uint8_t reg, uint8_t value) {
  if (!spi_) {
    return write_twi(kMpuAddress, reg, value);
  }
  hal::write_sensor(reg, value);
  return true;
}

bool MagBus::read(uint8_t address, uint8_t reg, uint8_t* out, uint8_t size) {
  return read_twi(address, reg, out, size);
}

bool MagBus::write(uint8_t address, uint8_t reg, uint8_t value) {
  return write_twi(address, reg, value);
}

}  // namespace imu
