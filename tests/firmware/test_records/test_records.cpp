// Settings and session numbers as they stand in EEPROM.
#include <string.h>

#include "check.h"
#include "core/bytes.h"
#include "core/crc.h"
#include "core/session_record.h"
#include "core/settings.h"

namespace {

using core::SettingsStatus;

struct Record {
  uint8_t bytes[core::kSettingsRecordSize];
  frames::ConfigFrame config;

  Record() {
    core::default_settings(config);
    config.hold_ms = 250;
    core::write_settings(bytes, config);
  }
  void seal() {
    core::Crc32 crc;
    crc.add(bytes, sizeof(bytes) - 4);
    core::put_le(bytes + sizeof(bytes) - 4, crc.value());
  }
  SettingsStatus read(frames::ConfigFrame& out) const { return core::read_settings(bytes, out); }
};

}  // namespace

TEST_CASE("the defaults are in range and are what settings.toml says") {
  frames::ConfigFrame config;
  memset(&config, 0xEE, sizeof(config));
  core::default_settings(config);
  CHECK(core::settings_in_range(config));
  CHECK_EQ(config.rate_hz, 100);
  CHECK_EQ(config.hold_ms, 0);
  CHECK_EQ(config.aircraft[15], 0);
}

TEST_CASE("a record comes back as it was written") {
  const Record record;
  frames::ConfigFrame out;
  CHECK(record.read(out) == SettingsStatus::kOk);
  CHECK_EQ(out.hold_ms, 250);
  CHECK(memcmp(reinterpret_cast<const uint8_t*>(&out) + 4,
               reinterpret_cast<const uint8_t*>(&record.config) + 4,
               core::kSettingsSize) == 0);
}

TEST_CASE("the record has the layout of the frame from rate_hz on") {
  const Record record;
  CHECK_EQ(core::get_le<uint16_t>(record.bytes + 4), 100);
  CHECK_EQ(core::kSettingsSize + 4, static_cast<uint8_t>(sizeof(frames::ConfigFrame)));
}

TEST_CASE("each flipped bit leaves the defaults") {
  Record record;
  uint16_t accepted = 0;
  for (uint16_t bit = 0; bit < 8 * core::kSettingsRecordSize; ++bit) {
    record.bytes[bit / 8] = static_cast<uint8_t>(record.bytes[bit / 8] ^ 1U << bit % 8);
    frames::ConfigFrame out;
    const bool damaged = record.read(out) == SettingsStatus::kDamaged && out.hold_ms == 0;
    accepted = static_cast<uint16_t>(accepted + !damaged);
    record.bytes[bit / 8] = static_cast<uint8_t>(record.bytes[bit / 8] ^ 1U << bit % 8);
  }
  CHECK_EQ(accepted, 0);
}

TEST_CASE("an erased EEPROM and another version are told apart") {
  Record record;
  frames::ConfigFrame out;
  record.bytes[2] = frames::kVersion + 1;
  record.seal();
  CHECK(record.read(out) == SettingsStatus::kOtherVersion);
  memset(record.bytes, 0xFF, sizeof(record.bytes));
  CHECK(record.read(out) == SettingsStatus::kDamaged);
}

TEST_CASE("a value out of range refuses the record as a whole") {
  Record record;
  frames::ConfigFrame out;
  record.config.hold_ms = 1001;
  core::write_settings(record.bytes, record.config);
  CHECK(record.read(out) == SettingsStatus::kOutOfRange);
  CHECK_EQ(out.hold_ms, 0);
  record.config.hold_ms = 1000;
  record.config.rate_hz = 0;
  core::write_settings(record.bytes, record.config);
  CHECK(record.read(out) == SettingsStatus::kOutOfRange);
}

TEST_CASE("two channels on one input, or thresholds that touch, are refused") {
  frames::ConfigFrame config;
  core::default_settings(config);
  config.input_rudder = config.input_switch;
  CHECK(!core::settings_in_range(config));
  config.input_rudder = 255;
  CHECK(!core::settings_in_range(config));
  core::default_settings(config);
  config.switch_mega_min_us = static_cast<uint16_t>(config.switch_direct_max_us + 99);
  CHECK(!core::settings_in_range(config));
}

namespace {

struct Eeprom {
  uint8_t slots[core::kSessionSlots][core::kSessionSlotSize];

  Eeprom() { memset(slots, 0xFF, sizeof(slots)); }
  core::SessionStore read() const {
    core::SessionStore store;
    // Backwards: the order must not matter.
    for (uint8_t i = core::kSessionSlots; i != 0; --i) {
      store.slot(static_cast<uint8_t>(i - 1), slots[i - 1]);
    }
    return store;
  }
  void write(core::SessionStore& store, uint32_t session, uint32_t boots) {
    uint8_t bytes[core::kSessionSlotSize];
    core::SessionRecord record;
    record.session = session;
    record.boots = boots;
    const uint8_t slot = store.next(record, bytes);
    memcpy(slots[slot], bytes, sizeof(bytes));
  }
};

}  // namespace

TEST_CASE("an erased EEPROM holds no session") {
  const Eeprom eeprom;
  const core::SessionStore store = eeprom.read();
  CHECK(!store.found());
  CHECK(store.latest().session == 0U);
}

TEST_CASE("the latest of many writes is found, and each slot wears alike") {
  Eeprom eeprom;
  uint8_t used[core::kSessionSlots] = {};
  for (uint32_t i = 1; i <= 160; ++i) {
    core::SessionStore store = eeprom.read();
    CHECK(store.latest().session == i - 1);
    uint8_t bytes[core::kSessionSlotSize];
    core::SessionRecord record;
    record.session = i;
    record.boots = 2 * i;
    const uint8_t slot = store.next(record, bytes);
    memcpy(eeprom.slots[slot], bytes, sizeof(bytes));
    ++used[slot];
  }
  CHECK(eeprom.read().latest().boots == 320U);
  uint8_t uneven = 0;
  for (const uint8_t count : used) {
    uneven = static_cast<uint8_t>(uneven + (count != 10));
  }
  CHECK_EQ(uneven, 0);
}

TEST_CASE("a write torn by a power cut costs that write only") {
  for (uint8_t torn = 0; torn < core::kSessionSlotSize; ++torn) {
    Eeprom eeprom;
    core::SessionStore store = eeprom.read();
    for (uint32_t i = 1; i <= 20; ++i) {
      eeprom.write(store, i, i);
    }
    uint8_t bytes[core::kSessionSlotSize];
    core::SessionRecord record;
    record.session = 21;
    record.boots = 21;
    const uint8_t slot = store.next(record, bytes);
    memcpy(eeprom.slots[slot], bytes, torn);
    CHECK(eeprom.read().latest().session == 20U);
  }
}

TEST_CASE("a count of writes that no EEPROM bears is not believed") {
  Eeprom eeprom;
  core::SessionStore store = eeprom.read();
  eeprom.write(store, 7, 8);
  uint8_t* const forged = eeprom.slots[9];
  memset(forged, 0xFF, core::kSessionSlotSize);
  constexpr uint8_t kCrc = core::kSessionSlotSize - 2;
  core::put_le(forged + kCrc, core::crc16(core::kCrc16Start, forged, kCrc));
  // Believed, the next write would carry the count 0, and be the oldest of all for ever.
  core::SessionStore again = eeprom.read();
  CHECK(again.latest().session == 7U);
  eeprom.write(again, 8, 9);
  CHECK(eeprom.read().latest().session == 8U);
}

TEST_CASE(
    "settings of the inputs: their own record, defaults else, and armed never too near Mega") {
  frames::ConfigFrame config;
  core::default_settings(config);
  uint8_t record[core::kInputSettingsRecordSize];
  frames::InputConfigFrame wanted = {};
  frames::InputConfigFrame read;
  const uint16_t good[] = {0, 1800, 1950, 2100};
  for (const uint16_t armed_us : good) {
    wanted.switch_armed_min_us = armed_us;
    core::write_input_settings(record, wanted);
    core::read_input_settings(record, config, read);
    CHECK_EQ(uint16_t{read.switch_armed_min_us}, armed_us);
  }
  const uint16_t bad[] = {1, 1799, 2101, 0xFFFF};
  for (const uint16_t armed_us : bad) {
    wanted.switch_armed_min_us = armed_us;
    core::write_input_settings(record, wanted);
    core::read_input_settings(record, config, read);
    CHECK_EQ(uint16_t{read.switch_armed_min_us}, 1850);
  }
  for (uint8_t i = 0; i < sizeof record; ++i) record[i] = 0xFF;
  core::read_input_settings(record, config, read);
  CHECK_EQ(uint16_t{read.switch_armed_min_us}, 1850);
  config.switch_mega_min_us = 1700;  // the default does not go with it: never armed
  core::read_input_settings(record, config, read);
  CHECK_EQ(uint16_t{read.switch_armed_min_us}, 0);
}

TEST_CASE(
    "a record of another size is another version's, whichever way; the rest of a frame is 0") {
  for (int8_t by = -1; by <= 1; by = static_cast<int8_t>(by + 2)) {
    Record record;
    record.bytes[3] = static_cast<uint8_t>(core::kSettingsSize + by);
    record.seal();
    frames::ConfigFrame out;
    CHECK(record.read(out) == SettingsStatus::kOtherVersion);
    CHECK_EQ(out.hold_ms, 0);
  }
  Record record;
  record.bytes[2] = frames::kVersion - 1;
  record.seal();
  frames::ConfigFrame out;
  CHECK(record.read(out) == SettingsStatus::kOtherVersion);
  const Record good;
  memset(&out, 0xEE, sizeof(out));
  CHECK(good.read(out) == SettingsStatus::kOk);
  CHECK_EQ(out.t_us, 0U);
  CHECK_EQ(good.bytes[0], 'F');
  CHECK_EQ(good.bytes[1], 'S');
}

TEST_CASE("each of five channels has an input of its own, thresholds are 100 us apart") {
  frames::ConfigFrame config;
  for (uint8_t a = 0; a < 5; ++a) {
    for (uint8_t b = 0; b < 5; ++b) {
      core::default_settings(config);
      uint8_t inputs[] = {0, 1, 2, 3, 4};
      inputs[a] = inputs[b];
      config.input_aileron = inputs[0];
      config.input_elevator = inputs[1];
      config.input_rudder = inputs[2];
      config.input_throttle = inputs[3];
      config.input_switch = inputs[4];
      CHECK_EQ(core::settings_in_range(config), a == b);
    }
  }
  core::default_settings(config);
  config.switch_mega_min_us = static_cast<uint16_t>(config.switch_direct_max_us + 100);
  CHECK(core::settings_in_range(config));
}

TEST_CASE("the inputs' record: its letters, its fields, the CRC-16 of both; each bit counts") {
  frames::ConfigFrame config;
  core::default_settings(config);
  uint8_t record[core::kInputSettingsRecordSize];
  frames::InputConfigFrame wanted = {};
  wanted.switch_armed_min_us = 1950;
  core::write_input_settings(record, wanted);
  CHECK_EQ(record[0], 'I');
  CHECK_EQ(record[1], 'S');
  const uint8_t sum_at = core::kInputSettingsRecordSize - 2;
  CHECK_EQ(core::get_le<uint16_t>(record + sum_at), core::crc16(0xFFFF, record, sum_at));
  frames::InputConfigFrame read;
  for (uint16_t bit = 0; bit < 8 * core::kInputSettingsRecordSize; ++bit) {
    record[bit / 8] = static_cast<uint8_t>(record[bit / 8] ^ 1U << bit % 8);
    memset(&read, 0xEE, sizeof(read));
    core::read_input_settings(record, config, read);
    CHECK_EQ(uint16_t{read.switch_armed_min_us}, 1850);
    record[bit / 8] = static_cast<uint8_t>(record[bit / 8] ^ 1U << bit % 8);
  }
  memset(&read, 0xEE, sizeof(read));
  core::read_input_settings(record, config, read);
  CHECK_EQ(uint16_t{read.switch_armed_min_us}, 1950);
  CHECK_EQ(read.t_us, 0U);
  // 100 us of its own on either side of the threshold: 1950 goes with 1750, not with 1751.
  config.switch_mega_min_us = 1750;
  core::read_input_settings(record, config, read);
  CHECK_EQ(uint16_t{read.switch_armed_min_us}, 1950);
  config.switch_mega_min_us = 1751;
  core::read_input_settings(record, config, read);
  CHECK_EQ(uint16_t{read.switch_armed_min_us}, 0);
  config.switch_mega_min_us = 1650;
  wanted.switch_armed_min_us = 1849;
  core::write_input_settings(record, wanted);
  core::read_input_settings(record, config, read);
  CHECK_EQ(uint16_t{read.switch_armed_min_us}, 1850);
}
