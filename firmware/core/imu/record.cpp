#include "core/imu/record.h"

#include <string.h>

#include "core/bytes.h"
#include "core/crc.h"

namespace core {
namespace {

constexpr uint16_t kMagic = 0x4941;  // "AI"
constexpr uint8_t kVersion = 1;
constexpr uint8_t kHead = 4;
constexpr uint8_t kCrcOffset = kHead + sizeof(ImuSettings);
constexpr int16_t kMostRate = 1638;   // 25 deg/s; the datasheet allows 20
constexpr int16_t kMostForce = 1638;  // 0.2 g; the datasheet allows 0.08

uint32_t record_crc(const uint8_t* record) {
  Crc32 crc;
  crc.add(record, kCrcOffset);
  return crc.value();
}

bool within(int16_t value, int16_t limit) {
  return value <= limit && value >= -limit;
}

}  // namespace

void default_imu_settings(ImuSettings& out) {
  memset(&out, 0, sizeof(out));
  out.declination_cdeg = 413;  // 4.13 deg east: the thesis's field
  out.dlpf = 2;
}

bool imu_settings_in_range(const ImuSettings& settings) {
  bool good = within(settings.declination_cdeg, kMostDeclinationCdeg) &&
              settings.offsets_valid <= 1 && settings.compat <= 1 && settings.dlpf <= kMostDlpf;
  for (uint8_t axis = 0; axis < 3; ++axis) {
    good = good && within(settings.rate_offset[axis], kMostRate) &&
           within(settings.force_offset[axis], kMostForce) &&
           within(settings.field_offset[axis], kMostIron);
  }
  return good;
}

bool read_imu_record(const uint8_t* record, ImuSettings& out) {
  if (get_le<uint16_t>(record) == kMagic && record[2] == kVersion &&
      record[3] == sizeof(ImuSettings) &&
      get_le<uint32_t>(record + kCrcOffset) == record_crc(record)) {
    memcpy(&out, record + kHead, sizeof(out));
    if (imu_settings_in_range(out)) {
      return true;
    }
  }
  default_imu_settings(out);
  return false;
}

void write_imu_record(uint8_t* record, const ImuSettings& settings) {
  put_le(record, kMagic);
  record[2] = kVersion;
  record[3] = sizeof(ImuSettings);
  memcpy(record + kHead, &settings, sizeof(settings));
  put_le(record + kCrcOffset, record_crc(record));
}

}  // namespace core
