#include "storage/folder.h"

#include <string.h>

#include "core/bytes.h"
#include "core/progmem.h"
#include "storage/boot_sector.h"

namespace storage {

using core::get_le;
using core::put_le;

namespace {

constexpr uint8_t kEntryBytes = 32;
constexpr uint8_t kEntries = kSectorBytes / kEntryBytes;
constexpr uint8_t kNameBytes = 11;
constexpr uint8_t kAttributesAt = 11, kCreatedAt = 16, kReadAt = 18, kHighAt = 20, kWrittenAt = 22,
                  kLowAt = 26, kSizeAt = 28;
constexpr uint8_t kDeleted = 0xE5;
constexpr uint8_t kLongName = 0x0F, kLongNameMask = 0x3F;
constexpr uint8_t kArchive = 0x20;

// A digit stands for each 0.
constexpr char kNamePattern[] CORE_FLASH = "FLT00000BIN";

const uint8_t* entry_at(const uint8_t* sector, uint8_t index) {
  return sector + index * kEntryBytes;
}
uint8_t* entry_at(uint8_t* sector, uint8_t index) {
  return sector + index * kEntryBytes;
}

void put_date(uint8_t* at, uint32_t date) {
  put_le(at + kWrittenAt, date);
  put_le(at + kReadAt, static_cast<uint16_t>(date >> 16));
}

}  // namespace

uint32_t flight_number(const uint8_t* name) {
  uint32_t number = 0;
  for (uint8_t place = 0; place < kNameBytes; ++place) {
    const uint8_t wanted = core::flash_u8(kNamePattern + place);
    if (wanted != '0') {
      if (name[place] != wanted) return 0;
      continue;
    }
    if (name[place] < '0' || name[place] > '9') return 0;
    number = number * 10 + static_cast<uint8_t>(name[place] - '0');
  }
  return number;
}

Entry read_entry(const uint8_t* sector, uint8_t index, bool wide) {
  const uint8_t* const at = entry_at(sector, index);
  const uint32_t high = wide ? get_le<uint16_t>(at + kHighAt) : 0U;
  return {high << 16 | get_le<uint16_t>(at + kLowAt),
          get_le<uint32_t>(at + kSizeAt),
          at[kAttributesAt]};
}

void make_entry(uint8_t* sector,
                uint8_t index,
                uint32_t number,
                uint32_t cluster,
                uint32_t bytes,
                uint32_t date) {
  uint8_t* const at = entry_at(sector, index);
  // Behind the first entry never used all are: some writers do not clear them.
  if (at[0] == 0 && index + 1 < kEntries) at[kEntryBytes] = 0;
  memset(at, 0, kEntryBytes);
  core::flash_copy(at, kNamePattern, kNameBytes);
  for (uint8_t place = 7; number > 0; --place) {
    at[place] = static_cast<uint8_t>('0' + number % 10);
    number /= 10;
  }
  at[kAttributesAt] = kArchive;
  put_le(at + kCreatedAt - 2, date);
  set_cluster(sector, index, cluster);
  set_size(sector, index, bytes, date);
}

void set_size(uint8_t* sector, uint8_t index, uint32_t bytes, uint32_t date) {
  uint8_t* const at = entry_at(sector, index);
  put_le(at + kSizeAt, bytes);
  put_date(at, date);
}

void set_cluster(uint8_t* sector, uint8_t index, uint32_t cluster) {
  uint8_t* const at = entry_at(sector, index);
  put_le(at + kHighAt, static_cast<uint16_t>(cluster >> 16));
  put_le(at + kLowAt, static_cast<uint16_t>(cluster));
}

bool FolderWalk::take(const uint8_t* sector, uint32_t lba) {
  for (uint8_t index = 0; index < kEntries; ++index) {
    const uint8_t* const at = entry_at(sector, index);
    if ((at[0] == 0 || at[0] == kDeleted) && free.lba == 0) free = {lba, index};
    if (at[0] == 0) return true;
    if (at[0] == kDeleted || (at[kAttributesAt] & kLongNameMask) == kLongName) continue;
    const uint32_t found = flight_number(at);
    if (found > number) {
      number = found;
      newest = {lba, index};
    }
  }
  return false;
}

}  // namespace storage
