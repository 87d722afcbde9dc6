// What the EEPROM keeps: the settings, the numbers of sessions and boots, the chip's reference.
#pragma once

#include <stdint.h>

#include "core/session_record.h"
#include "core/settings.h"
#include "core/supply.h"
#include "hal/eeprom.h"

namespace app {

class Store {
 public:
  static constexpr uint16_t kSettingsAddress = 0;
  static constexpr uint16_t kInputSettingsAddress = 48;
  static constexpr uint16_t kSlotsAddress = 64;
  static constexpr uint16_t kReferenceAddress = hal::kEepromBytes - core::kReferenceRecordSize;
  static_assert(core::kSettingsRecordSize <= kInputSettingsAddress &&
                    kInputSettingsAddress + core::kInputSettingsRecordSize <= kSlotsAddress,
                "the records do not overlap");

  // Reads everything; a boot is counted. Writing goes on in poll().
  core::SettingsStatus load(frames::ConfigFrame* config);
  // Writes one byte of what waits, if the EEPROM is ready.
  void poll();

  uint32_t session() const { return record_.session; }  // largest given out
  uint32_t boots() const { return record_.boots; }
  void set_session(uint32_t session);
  uint16_t reference_mv() const { return reference_mv_; }  // 0: not calibrated

 private:
  void save();

  core::SessionStore slots_;
  core::SessionRecord record_;
  uint8_t bytes_[core::kSessionSlotSize] = {};
  uint16_t address_ = 0;
  uint16_t reference_mv_ = 0;
  uint8_t written_ = core::kSessionSlotSize;
  bool again_ = false;  // the record changed while it was being written
};

}  // namespace app
