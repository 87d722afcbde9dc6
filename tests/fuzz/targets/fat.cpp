// A card with anything on it. A good volume with flight files is altered byte by byte: boot sector,
// FSInfo, either copy of the allocation table, folder, blocks of the newest file. Then it is looked
// at, a file is made and closed. Every job ends; looking writes nothing; nothing is read or written
// outside the card; a file made takes clusters that the table in use called free, and is found
// again.
#include <array>
#include <set>
#include <unordered_map>
#include <vector>

#include "core/bytes.h"
#include "feed.h"
#include "hal/block_device.h"
#include "storage/block_build.h"
#include "storage/fat_sector.h"
#include "storage/volume.h"

namespace {

using Block = std::array<uint8_t, 512>;

constexpr uint32_t kReserved = 32;
constexpr uint32_t kFileBlocks = 64;
constexpr uint32_t kMostSteps = 2000000;

struct Card {
  std::unordered_map<uint32_t, Block> blocks;
  std::vector<uint32_t> written;
  uint32_t size = 0;
  uint32_t lba = 0;
  uint8_t waits = 0;  // polls until the block is done

  Block& at(uint32_t place) { return blocks.emplace(place, Block{}).first->second; }
};

Card g_card;
Block g_formatted[2];  // boot sector and block 0, as they should be

void put_entry(bool wide, uint32_t table, uint32_t cluster, uint32_t value) {
  const uint32_t per_block = wide ? 128 : 256;
  uint8_t* const block = g_card.at(table + cluster / per_block).data();
  if (wide) {
    core::put_le<uint32_t>(block + cluster % per_block * 4, value);
  } else {
    core::put_le<uint16_t>(block + cluster % per_block * 2, static_cast<uint16_t>(value));
  }
}

struct Volume {
  bool wide;
  uint32_t start, tables, table_blocks, root, data, clusters, shift;

  uint32_t lba_of(uint32_t cluster) const { return data + ((cluster - 2) << shift); }

  void file(uint32_t number, uint32_t cluster, uint32_t count, uint32_t used) const {
    for (uint32_t i = 0; i < count; ++i) {
      for (uint32_t copy = 0; copy < 2; ++copy) {
        put_entry(wide,
                  tables + copy * table_blocks,
                  cluster + i,
                  i + 1 == count ? 0x0FFFFFFFU : cluster + i + 1);
      }
    }
    storage::make_entry(g_card.at(root).data(),
                        static_cast<uint8_t>(number),
                        number,
                        cluster,
                        (count << shift) * 512,
                        0);
    const uint32_t id = 0x1D000000U + number;
    storage::build_schema_block(g_card.at(lba_of(cluster)).data(), id, number);
    for (uint32_t i = 1; i < used; ++i) {
      Block& block = g_card.at(lba_of(cluster) + i);
      core::BlockHeader header = {};
      header.file_id = id;
      header.session = number;
      header.sequence = i;
      storage::build_end_block(block.data(), header, {i, number, (count << shift) * 512});
    }
  }
};

Volume format(uint8_t what) {
  Volume volume = {};
  volume.wide = (what & 1) != 0;
  volume.start = (what & 2) != 0 ? 64 : 0;
  volume.shift = what >> 2 & 3;
  volume.clusters = volume.wide ? 700 : 4200;
  volume.table_blocks = volume.wide ? 8 : 20;
  volume.tables = volume.start + kReserved;
  const uint32_t behind = volume.tables + 2 * volume.table_blocks;
  const uint32_t root_blocks = volume.wide ? 0 : 32;
  volume.data = behind + root_blocks;
  volume.root = volume.wide ? volume.data : behind;
  const uint32_t total = volume.data - volume.start + (volume.clusters << volume.shift);
  g_card.size = volume.start + total;

  uint8_t* const boot = g_card.at(volume.start).data();
  boot[0] = 0xEB;
  core::put_le<uint16_t>(boot + 11, 512);
  boot[13] = static_cast<uint8_t>(1U << volume.shift);
  core::put_le<uint16_t>(boot + 14, kReserved);
  boot[16] = 2;
  core::put_le<uint16_t>(boot + 17, static_cast<uint16_t>(root_blocks * 16));
  core::put_le<uint32_t>(boot + 32, total);
  if (volume.wide) {
    core::put_le<uint32_t>(boot + 36, volume.table_blocks);
    core::put_le<uint32_t>(boot + 44, 2);
    core::put_le<uint16_t>(boot + 48, 1);
    uint8_t* const info = g_card.at(volume.start + 1).data();
    core::put_le<uint32_t>(info, 0x41615252U);
    core::put_le<uint32_t>(info + 484, 0x61417272U);
    core::put_le<uint32_t>(info + 488, volume.clusters - 200);
    core::put_le<uint32_t>(info + 492, 200);
    core::put_le<uint16_t>(info + 510, 0xAA55);
  } else {
    core::put_le<uint16_t>(boot + 22, static_cast<uint16_t>(volume.table_blocks));
  }
  core::put_le<uint16_t>(boot + 510, 0xAA55);
  if (volume.start != 0) {
    uint8_t* const partitions = g_card.at(0).data();
    partitions[446 + 4] = volume.wide ? 0x0C : 0x06;
    core::put_le<uint32_t>(partitions + 446 + 8, volume.start);
    core::put_le<uint32_t>(partitions + 446 + 12, total);
    core::put_le<uint16_t>(partitions + 510, 0xAA55);
  }
  for (uint32_t copy = 0; copy < 2; ++copy) {
    for (uint32_t cluster = 0; cluster < 3; ++cluster) {
      if (cluster < 2 || volume.wide) {
        put_entry(volume.wide, volume.tables + copy * volume.table_blocks, cluster, 0x0FFFFFF8U);
      }
    }
  }
  return volume;
}

// Blocks that say what is where: those are worth altering.
uint32_t place(const Volume& volume, Feed& feed) {
  const uint8_t which = feed.u8();
  switch (which & 7) {
    case 0:
      return volume.start;
    case 1:
      return volume.start + 1;
    case 2:
      return volume.tables + (which >> 4) % volume.table_blocks;
    case 3:
      return volume.tables + volume.table_blocks + (which >> 4) % volume.table_blocks;
    case 4:
    case 5:
      return volume.root + (which >> 6);
    case 6:
      return volume.lba_of(20) + (which >> 3);
    default:
      return 0;
  }
}

void finish(storage::Volume& volume, bool may_write) {
  static uint8_t sector[512];
  uint32_t steps = 0;
  while (!volume.step(sector, may_write)) {
    ALWAYS(++steps < kMostSteps);
    if (volume.waits() && !may_write) return;
  }
}

// Whether the boot sector still says where everything is. Altered, folder and clusters may lie one
// over the other, and no more can be asked than that every job ends.
bool as_formatted(const Volume& good) {
  return g_card.at(good.start) == g_formatted[0] && g_card.at(0) == g_formatted[1];
}

// Behind the allocation table a new file writes its first block and its entry, nothing else; and
// where the volume is what it was formatted to, its clusters were free.
void check_writes(const Volume& good,
                  const storage::FlightFile& made,
                  const std::unordered_map<uint32_t, Block>& before) {
  std::set<uint32_t> behind;
  for (const uint32_t lba : g_card.written) {
    ALWAYS(lba != 0 && lba != good.start);
    if (lba >= good.root) behind.insert(lba);
  }
  if (!as_formatted(good)) return;
  ALWAYS(behind.size() == 2 && behind.count(made.first_lba) == 1);
  const uint32_t per_block = good.wide ? 128 : 256;
  const uint32_t first = ((made.first_lba - good.data) >> good.shift) + 2;
  const uint32_t count = (made.blocks + (1U << good.shift) - 1) >> good.shift;
  for (uint32_t cluster = first; cluster < first + count; ++cluster) {
    const auto block = before.find(good.tables + cluster / per_block);
    if (block == before.end()) continue;  // zeros
    const uint8_t* const bytes = block->second.data();
    const uint32_t value = good.wide ? core::get_le<uint32_t>(bytes + cluster % per_block * 4)
                                     : core::get_le<uint16_t>(bytes + cluster % per_block * 2);
    ALWAYS((value & (good.wide ? 0x0FFFFFFFU : 0xFFFFU)) == 0);
  }
}

}  // namespace

namespace hal {

void start_card() {}
CardStatus poll_start() {
  return CardStatus::kOk;
}
void begin_read(uint32_t lba) {
  ALWAYS(lba < g_card.size);
  g_card.lba = lba;
}
CardStatus poll_read(uint8_t* block) {
  memcpy(block, g_card.at(g_card.lba).data(), 512);
  return CardStatus::kOk;
}
void begin_write(uint32_t lba) {
  ALWAYS(lba < g_card.size);
  g_card.lba = lba;
}
CardStatus poll_write(const uint8_t* block) {
  memcpy(g_card.at(g_card.lba).data(), block, 512);
  g_card.written.push_back(g_card.lba);
  return CardStatus::kOk;
}
CardStatus read_card_id(uint8_t* id) {
  memset(id, 7, kCardIdBytes);
  return CardStatus::kOk;
}
uint32_t card_blocks() {
  return g_card.size;
}

}  // namespace hal

int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  Feed feed(bytes, size);
  g_card = Card();
  const Volume good = format(feed.u8());
  const uint8_t files = feed.u8();
  const uint32_t count = kFileBlocks >> good.shift;
  if ((files & 1) != 0) good.file(1, 150, count, kFileBlocks);
  if ((files & 2) != 0) good.file(2, 20, count, 1 + (files >> 2));
  g_formatted[0] = g_card.at(good.start);
  g_formatted[1] = g_card.at(0);
  while (feed.more()) {
    Block& block = g_card.at(place(good, feed));
    const uint16_t at = feed.u16() % 512;
    const uint8_t run = feed.u8();
    for (uint16_t i = 0; i <= run >> 6; ++i) block[(at + i) % 512] = feed.u8();
  }

  storage::Volume volume;
  volume.set_file_blocks(kFileBlocks);
  volume.look();
  finish(volume, false);
  ALWAYS(volume.job() == storage::Volume::Job::kNone);
  ALWAYS(g_card.written.empty());
  if (volume.status() != storage::VolumeStatus::kReady) return 0;
  const storage::FlightFile found = volume.file();
  ALWAYS(found.next_block <= found.blocks);
  ALWAYS(found.blocks == 0 || found.first_lba + found.blocks <= g_card.size);

  // On the ground: closed and mended, room looked for, the next file made.
  if (volume.state() == storage::FileState::kOpen) {
    volume.close(found.next_block, (files & 1) != 0, 5);
    finish(volume, true);
    ALWAYS(volume.state() == storage::FileState::kClosed);
  } else if (volume.can_mend()) {
    volume.mend();
    finish(volume, true);
  }
  volume.search();
  finish(volume, true);
  if (volume.best_blocks() < 2) return 0;
  g_card.written.clear();
  const std::unordered_map<uint32_t, Block> before = g_card.blocks;
  const bool blank = volume.state() == storage::FileState::kBlank;
  const uint32_t number = volume.file().number;
  volume.make(9, volume.file_blocks(), blank);
  finish(volume, true);
  if (volume.status() != storage::VolumeStatus::kReady) return 0;
  const storage::FlightFile made = volume.file();
  ALWAYS(made.number == number + (blank ? 0 : 1));
  ALWAYS(made.next_block == 1 && made.blocks >= 2);
  check_writes(good, made, before);
  volume.look();
  finish(volume, false);
  ALWAYS(volume.status() == storage::VolumeStatus::kReady || !as_formatted(good));
  if (as_formatted(good) && volume.file().number == made.number) {
    ALWAYS(volume.file().first_lba == made.first_lba);
    ALWAYS(volume.state() == storage::FileState::kBlank);
  }
  return 0;
}
