#include "core/settings.h"

#include "core/bytes.h"
#include "core/crc.h"
#include "generated/settings.h"

namespace core {
namespace {

constexpr uint16_t kMagic = 0x5346;  // "FS"
constexpr uint8_t kHead = 4;
constexpr uint8_t kFirst = sizeof(uint32_t);  // t_us is not part of the record
constexpr uint8_t kCrcOffset = kHead + kSettingsSize;

uint32_t record_crc(const uint8_t* record) {
  Crc32 crc;
  crc.add(record, kCrcOffset);
  return crc.value();
}

}  // namespace

void default_settings(frames::ConfigFrame& out) {
  settings::put_defaults(out);
}

bool settings_in_range(const frames::ConfigFrame& config) {
  if (!settings::in_range(config)) {
    return false;
  }
  const uint8_t inputs = static_cast<uint8_t>(
      1U << config.input_aileron | 1U << config.input_elevator | 1U << config.input_rudder |
      1U << config.input_throttle | 1U << config.input_switch);
  return inputs == 0b1'1111 &&
         config.switch_mega_min_us >= config.switch_direct_max_us + settings::kLeastSwitchGapUs;
}

SettingsStatus read_settings(const uint8_t* record, frames::ConfigFrame& out) {
  SettingsStatus status = SettingsStatus::kOk;
  if (get_le<uint16_t>(record) != kMagic ||
      get_le<uint32_t>(record + kCrcOffset) != record_crc(record)) {
    status = SettingsStatus::kDamaged;
  } else if (record[2] != frames::kVersion || record[3] != kSettingsSize) {
    status = SettingsStatus::kOtherVersion;
  } else {
    memset(&out, 0, sizeof(out));
    memcpy(reinterpret_cast<uint8_t*>(&out) + kFirst, record + kHead, kSettingsSize);
    if (!settings_in_range(out)) {
      status = SettingsStatus::kOutOfRange;
    }
  }
  if (status != SettingsStatus::kOk) {
    default_settings(out);
  }
  return status;
}

void write_settings(uint8_t* record, const frames::ConfigFrame& config) {
  put_le(record, kMagic);
  record[2] = frames::kVersion;
  record[3] = kSettingsSize;
  memcpy(record + kHead, reinterpret_cast<const uint8_t*>(&config) + kFirst, kSettingsSize);
  put_le(record + kCrcOffset, record_crc(record));
}

}  // namespace core
