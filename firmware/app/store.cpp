#include "app/store.h"

#include "hal/eeprom.h"

namespace app {

namespace {

void read(uint16_t address, uint8_t* to, uint8_t size) {
  while (size-- != 0) *to++ = hal::read_eeprom(address++);
}

}  // namespace

core::SettingsStatus Store::load(frames::ConfigFrame* config) {
  uint8_t record[core::kSettingsRecordSize];
  read(kSettingsAddress, record, core::kSettingsRecordSize);
  const core::SettingsStatus status = core::read_settings(record, *config);
  read(kReferenceAddress, record, core::kReferenceRecordSize);
  reference_mv_ = core::read_reference(record);
  for (uint8_t slot = 0; slot < core::kSessionSlots; ++slot) {
    read(static_cast<uint16_t>(kSlotsAddress + slot * core::kSessionSlotSize),
         bytes_,
         core::kSessionSlotSize);
    slots_.slot(slot, bytes_);
  }
  record_ = slots_.latest();
  ++record_.boots;
  save();
  return status;
}

void Store::set_session(uint32_t session) {
  record_.session = session;
  if (written_ < core::kSessionSlotSize) {
    again_ = true;
  } else {
    save();
  }
}

void Store::save() {
  const uint8_t slot = slots_.next(record_, bytes_);
  address_ = static_cast<uint16_t>(kSlotsAddress + slot * core::kSessionSlotSize);
  written_ = 0;
}

void Store::poll() {
  if (written_ == core::kSessionSlotSize) {
    if (!again_) return;
    again_ = false;
    save();
  }
  if (!hal::eeprom_ready()) return;
  hal::write_eeprom(static_cast<uint16_t>(address_ + written_), bytes_[written_]);
  ++written_;
}

}  // namespace app
