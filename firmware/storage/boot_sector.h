// Where a FAT volume has its parts. Microsoft, FAT: General Overview of On-Disk Format 1.03.
#pragma once

#include <stdint.h>

namespace storage {

constexpr uint16_t kSectorBytes = 512;
constexpr uint8_t kPartitions = 4;
constexpr uint32_t kFirstCluster = 2;

// Places are blocks of the card, counted from its start.
struct Layout {
  uint32_t fat_lba;       // first copy
  uint32_t fat_sectors;   // from one copy to the next
  uint32_t data_lba;      // of cluster 2
  uint32_t clusters;      // numbered from 2
  uint32_t root;          // of FAT32 a cluster, of FAT16 a block
  uint32_t info_lba;      // FSInfo; 0: none
  uint16_t root_sectors;  // of FAT16; else 0
  uint8_t cluster_shift;  // log2 of the blocks in a cluster
  uint8_t fats;           // copies that are kept alike
  bool wide;              // FAT32

  bool has_cluster(uint32_t cluster) const {
    return cluster >= kFirstCluster && cluster - kFirstCluster < clusters;
  }
  uint32_t lba_of(uint32_t cluster) const {
    return data_lba + ((cluster - kFirstCluster) << cluster_shift);
  }
  uint32_t cluster_of(uint32_t lba) const {
    return ((lba - data_lba) >> cluster_shift) + kFirstCluster;
  }
  uint32_t clusters_for(uint32_t blocks) const {
    return (blocks + (uint32_t{1} << cluster_shift) - 1) >> cluster_shift;
  }
};

enum class BootVerdict : uint8_t {
  kOk,
  kForeign,  // no boot sector of FAT16 or FAT32: another file system, a partition table, nothing
  kDamaged,  // one with a number that cannot be
};

// Reads the boot sector of a volume that begins at block `lba` of a card of `card_blocks`. A volume
// that claims to go on behind the card's end is taken as far as the card goes.
BootVerdict read_boot(const uint8_t* sector, uint32_t lba, uint32_t card_blocks, Layout& out);

// First block of a partition of the master boot record; 0: none, or `sector` is no such record.
uint32_t partition_start(const uint8_t* sector, uint8_t index);

// FSInfo: number of free clusters, where to look for one. False if it is none of both.
bool read_info(const uint8_t* sector, uint32_t& free_clusters, uint32_t& next);
constexpr uint32_t kUnknown = 0xFFFFFFFFUL;
void put_info(uint8_t* sector, uint32_t free_clusters, uint32_t next);

}  // namespace storage
