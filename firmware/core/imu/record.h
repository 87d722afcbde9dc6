// What the IMU keeps in EEPROM: offsets found at rest and what the user chose. A record that is
// damaged gives the defaults and says so in every packet (offsets_valid is 0).
#pragma once

#include <stdint.h>

namespace core {

struct __attribute__((packed)) ImuSettings {
  int16_t rate_offset[3];    // body axes, 65.5 LSB per deg/s, taken off every sample
  int16_t force_offset[3];   // body axes, 8192 LSB per g
  int16_t field_offset[3];   // hard iron, body axes, 1090 LSB per gauss
  int16_t declination_cdeg;  // east positive
  int16_t offsets_cdegc;     // temperature of the chip when the rate offsets were found
  uint8_t offsets_valid;
  uint8_t dlpf;    // DLPF_CFG: 2 for 200 Hz, 3 for 100 Hz
  uint8_t compat;  // 1: the two original packets at 50 Hz instead of ours at 200 Hz
};

constexpr int16_t kMostDeclinationCdeg = 18000;
constexpr int16_t kMostIron = 2048;  // the span of the HMC5883L
constexpr uint8_t kMostDlpf = 6;     // 7 is reserved

constexpr uint8_t kImuRecordSize =
    4 + sizeof(ImuSettings) + 4;  // magic, version, size, ..., CRC-32

void default_imu_settings(ImuSettings& out);
bool imu_settings_in_range(const ImuSettings& settings);

// False leaves the defaults in `out`.
bool read_imu_record(const uint8_t* record, ImuSettings& out);
void write_imu_record(uint8_t* record, const ImuSettings& settings);

}  // namespace core
