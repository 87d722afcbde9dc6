// The root folder, sector by sector: the flight file with the largest number, a free entry.
#pragma once

#include <stdint.h>

namespace storage {

// Where an entry stands: a block of the card, and which of its 16.
struct EntryPlace {
  uint32_t lba;  // 0: nowhere
  uint8_t index;
};

// What an entry says of its file.
struct Entry {
  uint32_t cluster;
  uint32_t bytes;
  uint8_t attributes;

  static constexpr uint8_t kReadOnly = 0x01, kVolume = 0x08, kFolder = 0x10;
};

Entry read_entry(const uint8_t* sector, uint8_t index, bool wide);
// Makes an entry FLTnnnnn.BIN of the run of clusters from `cluster`.
void make_entry(uint8_t* sector,
                uint8_t index,
                uint32_t number,
                uint32_t cluster,
                uint32_t bytes,
                uint32_t date);
void set_size(uint8_t* sector, uint8_t index, uint32_t bytes, uint32_t date);
void set_cluster(uint8_t* sector, uint8_t index, uint32_t cluster);
// The number in a name of that kind, whatever the entry is; 0: another name.
uint32_t flight_number(const uint8_t* name);

// Plain data: `= {}` begins a walk.
struct FolderWalk {
  // True: the folder ends in this sector.
  bool take(const uint8_t* sector, uint32_t lba);

  uint32_t number;    // the largest; 0: no flight file
  EntryPlace newest;  // that file's entry
  EntryPlace free;    // an entry for the next file
};

}  // namespace storage
