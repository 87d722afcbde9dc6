// Entries of the file allocation table, as they stand in one of its sectors.
#pragma once

#include <stdint.h>

#include "core/bytes.h"
#include "storage/boot_sector.h"

namespace storage {

constexpr uint32_t kEntryMask = 0x0FFFFFFFUL;
constexpr uint32_t kFreeEntry = 0;
constexpr uint32_t kEndEntry = kEntryMask;
constexpr uint32_t kLeastEndEntry = 0x0FFFFFF8UL;

// log2 of the entries in a sector.
inline uint8_t entries_shift(const Layout& layout) {
  return layout.wide ? 7 : 8;
}
inline uint16_t entry_index(const Layout& layout, uint32_t cluster) {
  return static_cast<uint16_t>(cluster) & static_cast<uint16_t>((1U << entries_shift(layout)) - 1U);
}
// Block of the first copy that holds the entry of a cluster.
inline uint32_t entry_lba(const Layout& layout, uint32_t cluster) {
  return layout.fat_lba + (cluster >> entries_shift(layout));
}

// An entry in the numbers of FAT32, whatever the table is.
inline uint32_t entry(const uint8_t* sector, const Layout& layout, uint16_t index) {
  if (layout.wide) return core::get_le<uint32_t>(sector + 4 * index) & kEntryMask;
  const uint16_t value = core::get_le<uint16_t>(sector + 2 * index);
  return value < 0xFFF0U ? value : 0x0FFF0000UL | value;
}
// The upper four bits of FAT32 stay.
inline void put_entry(uint8_t* sector, const Layout& layout, uint16_t index, uint32_t value) {
  if (layout.wide) {
    const uint32_t kept = core::get_le<uint32_t>(sector + 4 * index) & ~kEntryMask;
    core::put_le<uint32_t>(sector + 4 * index, kept | (value & kEntryMask));
  } else {
    core::put_le(sector + 2 * index, static_cast<uint16_t>(value));
  }
}

}  // namespace storage
