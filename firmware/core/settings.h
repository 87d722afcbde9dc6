// What a pilot chooses: a record in EEPROM, laid out as the frame `config` from rate_hz on.
#pragma once

#include <stdint.h>

#include "generated/frames.h"

namespace core {

constexpr uint8_t kSettingsSize = sizeof(frames::ConfigFrame) - sizeof(uint32_t);
constexpr uint8_t kSettingsRecordSize = 4 + kSettingsSize + 4;  // magic, version, size, ..., CRC-32

// Above 0: the argument of the event `settings_default`.
enum class SettingsStatus : uint8_t { kOk = 0, kDamaged = 1, kOtherVersion = 2, kOutOfRange = 3 };

// From firmware/settings.toml; t_us is 0.
void default_settings(frames::ConfigFrame& out);
bool settings_in_range(const frames::ConfigFrame& config);

// The inputs' own settings stand behind that record: magic u16, the fields of the frame
// `input_config` behind t_us, CRC-16.
constexpr uint8_t kInputSettingsSize = sizeof(frames::InputConfigFrame) - sizeof(uint32_t);
constexpr uint8_t kInputSettingsRecordSize = 2 + kInputSettingsSize + 2;
// Of a record that is none, or that does not go with `config`: the defaults; armed is 0 (no input
// is ever flown) where these do not go with it either.
void read_input_settings(const uint8_t* record,
                         const frames::ConfigFrame& config,
                         frames::InputConfigFrame& out);
void write_input_settings(uint8_t* record, const frames::InputConfigFrame& config);

// Anything but kOk leaves the defaults in `out`.
SettingsStatus read_settings(const uint8_t* record, frames::ConfigFrame& out);
void write_settings(uint8_t* record, const frames::ConfigFrame& config);

}  // namespace core
