// Whatever an EEPROM holds: settings are the record's and in range, or the defaults; the records of
// the IMU and of the session numbers likewise.
#include "core/settings.h"
#include "core/bytes.h"
#include "core/crc.h"
#include "core/imu/record.h"
#include "core/session_record.h"
#include "feed.h"

namespace {

// Of half the records magic, version, size and CRC are put right, or none would be looked into.
void put_right(uint8_t* record, uint8_t size, const uint8_t* good) {
  memcpy(record, good, 4);
  core::Crc32 crc;
  crc.add(record, static_cast<uint16_t>(size - 4));
  core::put_le(record + size - 4, crc.value());
}

void settings_of(Feed& feed) {
  uint8_t record[core::kSettingsRecordSize];
  uint8_t good[core::kSettingsRecordSize];
  frames::ConfigFrame defaults;
  core::default_settings(defaults);
  ALWAYS(core::settings_in_range(defaults));
  core::write_settings(good, defaults);
  const uint8_t what = feed.u8();
  memcpy(record, good, sizeof record);
  if ((what & 1) != 0) {
    feed.fill(record, sizeof record);
  } else {
    for (uint8_t left = what >> 4; left != 0; --left) {
      const uint8_t at = uint8_t(feed.u8() % sizeof record);
      record[at] = feed.u8();
    }
  }
  if ((what & 2) == 0) put_right(record, sizeof record, good);
  frames::ConfigFrame out;
  memset(&out, 0xA5, sizeof out);
  const core::SettingsStatus status = core::read_settings(record, out);
  ALWAYS(core::settings_in_range(out));
  ALWAYS(out.t_us == 0);
  if (status == core::SettingsStatus::kOk) {
    uint8_t again[core::kSettingsRecordSize];
    core::write_settings(again, out);
    ALWAYS(memcmp(again, record, sizeof record) == 0);
  } else {
    ALWAYS(memcmp(&out, &defaults, sizeof out) == 0);
  }
}

void imu_record_of(Feed& feed) {
  uint8_t record[core::kImuRecordSize];
  uint8_t good[core::kImuRecordSize];
  core::ImuSettings defaults;
  core::default_imu_settings(defaults);
  core::write_imu_record(good, defaults);
  const uint8_t what = feed.u8();
  feed.fill(record, sizeof record);
  if ((what & 1) == 0) put_right(record, sizeof record, good);
  core::ImuSettings out;
  if (core::read_imu_record(record, out)) {
    uint8_t again[core::kImuRecordSize];
    core::write_imu_record(again, out);
    ALWAYS(memcmp(again, record, sizeof record) == 0);
  } else {
    ALWAYS(memcmp(&out, &defaults, sizeof out) == 0);
  }
  ALWAYS(core::imu_settings_in_range(out));
}

void session_slots(Feed& feed) {
  core::SessionStore store;
  bool worn_out = false;
  uint8_t slots[core::kSessionSlots][core::kSessionSlotSize];
  for (uint8_t i = 0; i < core::kSessionSlots; ++i) {
    const uint8_t what = feed.u8();
    memset(slots[i], 0xFF, sizeof slots[i]);
    if ((what & 3) != 0) feed.fill(slots[i], sizeof slots[i]);
    if ((what & 2) != 0) {
      constexpr uint8_t kCrc = core::kSessionSlotSize - 2;
      core::put_le(slots[i] + kCrc, core::crc16(core::kCrc16Start, slots[i], kCrc));
    }
    worn_out = worn_out || core::get_le<uint32_t>(slots[i]) == core::kMostWrites;
    store.slot(i, slots[i]);
  }
  if (worn_out) return;
  // Written and read back: the numbers given are the latest, whatever is next to them.
  const core::SessionRecord given = {feed.u32(), feed.u32()};
  uint8_t bytes[core::kSessionSlotSize];
  const uint8_t slot = store.next(given, bytes);
  ALWAYS(slot < core::kSessionSlots);
  memcpy(slots[slot], bytes, sizeof bytes);
  core::SessionStore again;
  for (uint8_t i = 0; i < core::kSessionSlots; ++i) again.slot(i, slots[i]);
  ALWAYS(again.found());
  ALWAYS(again.latest().session == given.session);
  ALWAYS(again.latest().boots == given.boots);
}

}  // namespace

int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  Feed feed(bytes, size);
  switch (feed.u8() % 3) {
    case 0:
      settings_of(feed);
      break;
    case 1:
      imu_record_of(feed);
      break;
    default:
      session_slots(feed);
      break;
  }
  return 0;
}
