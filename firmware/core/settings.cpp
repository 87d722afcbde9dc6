#include "core/settings.h"

#include "core/bytes.h"
#include "core/crc.h"
#include "generated/settings.h"

namespace core {
namespace {

constexpr uint16_t kMagic = 0x5346;       // "FS"
constexpr uint16_t kInputMagic = 0x5349;  // "IS"
constexpr uint8_t kHead = 4;
constexpr uint8_t kFirst = sizeof(uint32_t);  // t_us is not part of the record
constexpr uint8_t kCrcOffset = kHead + kSettingsSize;

uint32_t record_crc(const uint8_t* record) {
  Crc32 crc;
  crc.add(record, kCrcOffset);
  return crc.value();
}

uint16_t input_crc(const uint8_t* record) {
  return crc16(kCrc16Start, record, 2 + kInputSettingsSize);
}

// Mega's place is as wide as the gap above it, or wider.
bool goes_with(const frames::InputConfigFrame& input, const frames::ConfigFrame& config) {
  return input.switch_armed_min_us == 0 ||
         input.switch_armed_min_us >= config.switch_mega_min_us + 2 * settings::kLeastSwitchGapUs;
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

void read_input_settings(const uint8_t* record,
                         const frames::ConfigFrame& config,
                         frames::InputConfigFrame& out) {
  uint8_t* const fields = reinterpret_cast<uint8_t*>(&out) + kFirst;
  memset(&out, 0, sizeof(out));
  memcpy(fields, record + 2, kInputSettingsSize);
  if (get_le<uint16_t>(record) == kInputMagic &&
      get_le<uint16_t>(record + 2 + kInputSettingsSize) == input_crc(record) &&
      settings::in_range(out) && goes_with(out, config)) {
    return;
  }
  settings::put_defaults(out);
  if (!goes_with(out, config)) out.switch_armed_min_us = 0;
}

void write_input_settings(uint8_t* record, const frames::InputConfigFrame& config) {
  put_le(record, kInputMagic);
  memcpy(record + 2, reinterpret_cast<const uint8_t*>(&config) + kFirst, kInputSettingsSize);
  put_le(record + 2 + kInputSettingsSize, input_crc(record));
}

}  // namespace core
