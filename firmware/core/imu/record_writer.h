// The record of the IMU's settings on its way into the EEPROM, a byte at a time.
#pragma once

#include <stdint.h>

#include "core/imu/record.h"

namespace core {

class RecordWriter {
 public:
  // Starts anew, in the middle of a record too.
  void keep(const ImuSettings& settings) {
    write_imu_record(bytes_, settings);
    at_ = 0;
  }

  // The next byte and its address, when the EEPROM is ready for it; false: all are written. The CRC
  // is at the end: a record cut off by the supply does not count.
  bool take(uint8_t& address, uint8_t& value) {
    if (at_ == kImuRecordSize) {
      return false;
    }
    address = at_;
    value = bytes_[at_];
    ++at_;
    return true;
  }

 private:
  uint8_t bytes_[kImuRecordSize] = {};
  uint8_t at_ = kImuRecordSize;
};

}  // namespace core
