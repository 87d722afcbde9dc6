#include "storage/boot_sector.h"

#include "core/bytes.h"

namespace storage {

using core::get_le;
using core::put_le;

namespace {

constexpr uint16_t kSignature = 0xAA55;
constexpr uint16_t kSignatureAt = 510;
constexpr uint16_t kPartitionAt = 446;
constexpr uint8_t kPartitionBytes = 16;
constexpr uint32_t kInfoHead = 0x41615252UL, kInfoMiddle = 0x61417272UL;
constexpr uint16_t kInfoMiddleAt = 484, kInfoFreeAt = 488, kInfoNextAt = 492;
constexpr uint32_t kLeastFat16 = 4085, kMostFat16 = 65524;
constexpr uint32_t kMostFat32 = 0x0FFFFFF5UL;
constexpr uint8_t kNameFat16At = 54;

bool is_signed(const uint8_t* sector) {
  return get_le<uint16_t>(sector + kSignatureAt) == kSignature;
}

bool power_of_two(uint8_t value) {
  return value != 0 && (value & (value - 1U)) == 0;
}

// The numbers that FAT12, 16 and 32 have in the same place.
bool is_fat(const uint8_t* sector) {
  const bool jump = sector[0] == 0xEB || sector[0] == 0xE9;
  return is_signed(sector) && jump && get_le<uint16_t>(sector + 11) == kSectorBytes &&
         power_of_two(sector[13]) && get_le<uint16_t>(sector + 14) != 0;
}

// The numbers of a FAT32 may be damaged into those of a FAT16. The name does not: every formatter
// writes it, and FAT32 keeps these bytes 0. How long its table is says nothing: some formatters
// lengthen it to align the clusters.
bool is_named(const uint8_t* sector) {
  const uint8_t* const name = sector + kNameFat16At;
  return name[0] == 'F' && name[1] == 'A' && name[2] == 'T';
}

}  // namespace

BootVerdict read_boot(const uint8_t* sector, uint32_t lba, uint32_t card_blocks, Layout& out) {
  if (!is_fat(sector)) return BootVerdict::kForeign;
  const uint8_t fats = sector[16];
  const uint16_t reserved = get_le<uint16_t>(sector + 14);
  const uint16_t root_entries = get_le<uint16_t>(sector + 17);
  uint32_t total = get_le<uint16_t>(sector + 19);
  if (total == 0) total = get_le<uint32_t>(sector + 32);
  uint32_t fat_sectors = get_le<uint16_t>(sector + 22);
  const bool wide = fat_sectors == 0;
  if (wide) fat_sectors = get_le<uint32_t>(sector + 36);
  if (fats < 1 || fats > 2 || lba >= card_blocks) return BootVerdict::kDamaged;
  if (total > card_blocks - lba) total = card_blocks - lba;
  // None of these sums overflows: fat_sectors is at most a quarter of the numbers there are.
  if (fat_sectors == 0 || fat_sectors > total / fats) return BootVerdict::kDamaged;
  if ((root_entries == 0) != wide || root_entries % 16 != 0) return BootVerdict::kDamaged;
  const uint16_t root_sectors = root_entries / 16;
  const uint32_t ahead = reserved + fats * fat_sectors + root_sectors;
  uint8_t shift = 0;
  while ((1U << shift) < sector[13]) ++shift;
  if (ahead >= total || (total - ahead) >> shift == 0) return BootVerdict::kDamaged;

  out.clusters = (total - ahead) >> shift;
  if (!wide && out.clusters < kLeastFat16) return BootVerdict::kForeign;  // FAT12
  if (!wide && !is_named(sector)) return BootVerdict::kDamaged;
  const uint32_t most = wide ? kMostFat32 : kMostFat16;
  const uint32_t in_fat = fat_sectors << (wide ? 7 : 8);
  if (out.clusters > most || out.clusters + kFirstCluster > in_fat) return BootVerdict::kDamaged;
  out.fat_lba = lba + reserved;
  out.fat_sectors = fat_sectors;
  out.data_lba = lba + ahead;
  out.root_sectors = root_sectors;
  out.cluster_shift = shift;
  out.fats = fats;
  out.wide = wide;
  out.info_lba = 0;
  if (!wide) {
    out.root = out.data_lba - root_sectors;
    return BootVerdict::kOk;
  }
  out.root = get_le<uint32_t>(sector + 44);
  const uint16_t flags = get_le<uint16_t>(sector + 40);
  if ((flags & 0x80U) != 0) {  // one copy alone is in use
    const uint8_t active = flags & 0x0FU;
    if (active >= fats) return BootVerdict::kDamaged;
    out.fat_lba += active * fat_sectors;
    out.fats = 1;
  }
  const uint16_t info = get_le<uint16_t>(sector + 48);
  if (info != 0 && info < reserved) out.info_lba = lba + info;
  const bool version_0 = get_le<uint16_t>(sector + 42) == 0;
  return version_0 && out.has_cluster(out.root) ? BootVerdict::kOk : BootVerdict::kDamaged;
}

uint32_t partition_start(const uint8_t* sector, uint8_t index) {
  if (!is_signed(sector)) return 0;
  return get_le<uint32_t>(sector + kPartitionAt + index * kPartitionBytes + 8);
}

bool read_info(const uint8_t* sector, uint32_t& free_clusters, uint32_t& next) {
  if (!is_signed(sector) || get_le<uint32_t>(sector) != kInfoHead ||
      get_le<uint32_t>(sector + kInfoMiddleAt) != kInfoMiddle) {
    return false;
  }
  free_clusters = get_le<uint32_t>(sector + kInfoFreeAt);
  next = get_le<uint32_t>(sector + kInfoNextAt);
  return true;
}

void put_info(uint8_t* sector, uint32_t free_clusters, uint32_t next) {
  put_le(sector + kInfoFreeAt, free_clusters);
  put_le(sector + kInfoNextAt, next);
}

}  // namespace storage
