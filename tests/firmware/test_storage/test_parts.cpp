// The parts of storage, each on sectors made by hand.
#include <string.h>

#include "check.h"
#include "core/bytes.h"
#include "random_numbers.h"
#include "storage/block_build.h"
#include "storage/boot_sector.h"
#include "storage/chain_check.h"
#include "storage/chain_edit.h"
#include "storage/end_search.h"
#include "storage/fat_sector.h"
#include "storage/folder.h"
#include "storage/free_run.h"

namespace {

using namespace storage;
using core::get_le;
using core::put_le;
using Odd = frames::FileState;

uint8_t sector[kSectorBytes];

constexpr uint32_t kCardBlocks = 62521344;  // 32 GB

void boot_fat32() {
  memset(sector, 0, sizeof sector);
  sector[0] = 0xEB;
  put_le<uint16_t>(sector + 11, 512);
  sector[13] = 64;
  put_le<uint16_t>(sector + 14, 32);
  sector[16] = 2;
  put_le<uint32_t>(sector + 32, kCardBlocks - 8192);
  put_le<uint32_t>(sector + 36, 7632);
  put_le<uint32_t>(sector + 44, 2);
  put_le<uint16_t>(sector + 48, 1);
  put_le<uint16_t>(sector + 510, 0xAA55);
}

void boot_fat16() {
  boot_fat32();
  put_le<uint16_t>(sector + 14, 1);
  put_le<uint16_t>(sector + 17, 512);
  put_le<uint16_t>(sector + 22, 239);
  put_le<uint32_t>(sector + 32, 3911680);  // 2 GB
  put_le<uint32_t>(sector + 36, 0);
  memcpy(sector + 54, "FAT16   ", 8);
}

BootVerdict read(Layout& layout) {
  return read_boot(sector, 8192, kCardBlocks, layout);
}

Layout small_layout(bool wide, uint32_t clusters) {
  Layout layout = {};
  layout.fat_lba = 100;
  layout.fat_sectors = 50;
  layout.data_lba = 1000;
  layout.clusters = clusters;
  layout.fats = 2;
  layout.wide = wide;
  return layout;
}

}  // namespace

TEST_CASE("a boot sector of FAT32 says where everything is") {
  boot_fat32();
  Layout layout;
  REQUIRE(read(layout) == BootVerdict::kOk);
  CHECK(layout.wide);
  CHECK_EQ(layout.fat_lba, 8192U + 32U);
  CHECK_EQ(layout.data_lba, 8192U + 32U + 2U * 7632U);
  CHECK_EQ(layout.clusters, (kCardBlocks - 8192U - 32U - 2U * 7632U) / 64U);
  CHECK_EQ(layout.cluster_shift, 6);
  CHECK_EQ(layout.fats, 2);
  CHECK_EQ(layout.info_lba, 8193U);
  CHECK_EQ(layout.root, 2U);
  CHECK_EQ(layout.lba_of(3), layout.data_lba + 64U);
  CHECK_EQ(layout.cluster_of(layout.lba_of(77)), 77U);
  CHECK(!layout.has_cluster(1));
  CHECK(layout.has_cluster(layout.clusters + 1));
  CHECK(!layout.has_cluster(layout.clusters + 2));
  CHECK(!layout.has_cluster(0xFFFFFFFFU));
}

TEST_CASE("a boot sector of FAT16 has its root folder before the clusters") {
  boot_fat16();
  Layout layout;
  REQUIRE(read(layout) == BootVerdict::kOk);
  CHECK(!layout.wide);
  CHECK_EQ(layout.root_sectors, 32);
  CHECK_EQ(layout.root, 8192U + 1U + 2U * 239U);
  CHECK_EQ(layout.data_lba, layout.root + 32U);
  CHECK_EQ(layout.info_lba, 0U);
}

// Card 1210 of `make card-images`: 64 bytes of noise gave a FAT32 the numbers of a FAT16.
TEST_CASE("a FAT32 with a root folder and a table of FAT16 is damaged") {
  boot_fat32();
  put_le<uint16_t>(sector + 14, 15);
  put_le<uint16_t>(sector + 17, 11264);
  put_le<uint16_t>(sector + 22, 12288);
  put_le<uint32_t>(sector + 32, 533387);
  sector[13] = 8;
  memcpy(sector + 82, "FAT32   ", 8);
  Layout layout;
  CHECK(read(layout) == BootVerdict::kDamaged);
}

TEST_CASE("a table of FAT16 may be longer than its clusters need, never shorter") {
  boot_fat16();
  put_le<uint16_t>(sector + 22, 239 + 4096);  // clusters begin at a multiple of 4 MiB
  Layout layout;
  CHECK(read(layout) == BootVerdict::kOk);
  put_le<uint16_t>(sector + 22, 238);
  CHECK(read(layout) == BootVerdict::kDamaged);
  boot_fat16();
  sector[13] = 32;  // 122 000 clusters
  put_le<uint16_t>(sector + 22, 478);
  CHECK(read(layout) == BootVerdict::kDamaged);
}

TEST_CASE("a volume that claims more than the card ends with the card") {
  boot_fat32();
  put_le<uint32_t>(sector + 32, 0xFFFFFFFFU);
  Layout layout;
  REQUIRE(read(layout) == BootVerdict::kOk);
  CHECK(layout.lba_of(layout.clusters + 1) + 64U <= kCardBlocks);
}

TEST_CASE("only the copy of the table in use counts") {
  boot_fat32();
  put_le<uint16_t>(sector + 40, 0x81);
  Layout layout;
  REQUIRE(read(layout) == BootVerdict::kOk);
  CHECK_EQ(layout.fats, 1);
  CHECK_EQ(layout.fat_lba, 8192U + 32U + 7632U);
  put_le<uint16_t>(sector + 40, 0x82);
  CHECK(read(layout) == BootVerdict::kDamaged);
}

TEST_CASE("a number that cannot be is damage, another file system is foreign") {
  struct Change {
    uint16_t at;
    uint8_t size;
    uint32_t value;
    BootVerdict verdict;
  };
  static const Change kChanges[] = {
      {0, 1, 0x33, BootVerdict::kForeign},      // code of a master boot record
      {510, 2, 0x1234, BootVerdict::kForeign},  // no signature
      {11, 2, 0, BootVerdict::kForeign},        // exFAT
      {11, 2, 4096, BootVerdict::kForeign},
      {13, 1, 0, BootVerdict::kForeign},
      {13, 1, 3, BootVerdict::kForeign},
      {14, 2, 0, BootVerdict::kForeign},
      {16, 1, 0, BootVerdict::kDamaged},
      {16, 1, 3, BootVerdict::kDamaged},
      {17, 2, 512, BootVerdict::kDamaged},  // root entries beside a FAT32
      {32, 4, 1000, BootVerdict::kDamaged},
      {36, 4, 0, BootVerdict::kDamaged},
      {36, 4, 100, BootVerdict::kDamaged},  // too short for its clusters
      {36, 4, 0x80000000U, BootVerdict::kDamaged},
      {42, 2, 1, BootVerdict::kDamaged},
      {44, 4, 0, BootVerdict::kDamaged},
      {44, 4, 0x00FFFFFF, BootVerdict::kDamaged},
  };
  for (const Change& change : kChanges) {
    boot_fat32();
    memcpy(sector + change.at, &change.value, change.size);
    Layout layout;
    CHECK_EQ(static_cast<int>(read(layout)), static_cast<int>(change.verdict));
  }
}

TEST_CASE("any boot sector: what is taken lies on the card") {
  Random random(5);
  Layout layout;
  uint16_t taken = 0;
  for (uint16_t round = 0; round < 2000; ++round) {
    boot_fat32();
    if (random.byte() < 100) boot_fat16();
    for (uint8_t changes = static_cast<uint8_t>(random.below(3) + 1); changes != 0; --changes) {
      sector[11 + random.below(45)] = random.byte();
    }
    if (read(layout) != BootVerdict::kOk) continue;
    ++taken;
    CHECK(layout.fat_lba >= 8192U);
    CHECK(layout.fat_lba + layout.fats * layout.fat_sectors <= layout.data_lba);
    CHECK(layout.clusters >= 1U);
    const uint32_t last_sector = (layout.clusters + 1) >> entries_shift(layout);
    CHECK(last_sector < layout.fat_sectors);
    CHECK(layout.lba_of(layout.clusters + 1) + (1UL << layout.cluster_shift) <= kCardBlocks);
    const bool root = layout.wide ? layout.has_cluster(layout.root) : layout.root_sectors > 0;
    CHECK(root);
  }
  CHECK(taken > 200);
}

TEST_CASE("FSInfo is believed with both its marks only") {
  memset(sector, 0, sizeof sector);
  put_le<uint32_t>(sector, 0x41615252U);
  put_le<uint32_t>(sector + 484, 0x61417272U);
  put_le<uint16_t>(sector + 510, 0xAA55);
  put_info(sector, 1234, 99);
  uint32_t free_clusters = 0;
  uint32_t next = 0;
  REQUIRE(read_info(sector, free_clusters, next));
  CHECK_EQ(free_clusters, 1234U);
  CHECK_EQ(next, 99U);
  sector[485] = 0;
  CHECK(!read_info(sector, free_clusters, next));
}

TEST_CASE("an entry of the table keeps its upper four bits, FAT16 counts as FAT32 does") {
  memset(sector, 0xFF, sizeof sector);
  const Layout wide = small_layout(true, 1000);
  put_entry(sector, wide, 5, 77);
  CHECK_EQ(get_le<uint32_t>(sector + 20), 0xF000004DU);
  CHECK_EQ(entry(sector, wide, 5), 77U);
  CHECK(entry(sector, wide, 6) >= kLeastEndEntry);
  const Layout narrow = small_layout(false, 5000);
  CHECK(entry(sector, narrow, 200) >= kLeastEndEntry);
  put_entry(sector, narrow, 200, kEndEntry);
  CHECK(entry(sector, narrow, 200) >= kLeastEndEntry);
  put_le<uint16_t>(sector, 0xFFF7);  // bad
  CHECK(entry(sector, narrow, 0) < kLeastEndEntry);
  CHECK(!narrow.has_cluster(entry(sector, narrow, 0)));
}

TEST_CASE("a chain is one run, or is told apart") {
  const Layout layout = small_layout(true, 500);
  struct Case {
    uint16_t at;
    uint32_t next;
    Odd state;
    uint32_t length;
  };
  static const Case kCases[] = {
      {0, 0, Odd::kGood, 20},
      {19, 30, Odd::kChainLong, 20},
      {19, 200, Odd::kNotInOnePiece, 20},
      {7, kEndEntry, Odd::kChainShort, 8},
      {7, kFreeEntry, Odd::kChainBroken, 8},
      {7, 0x0FFFFFF7, Odd::kChainBroken, 8},
      {7, 502, Odd::kChainBroken, 8},
      {7, 12, Odd::kCyclic, 8},
      {7, 17, Odd::kCyclic, 8},
      {7, 9, Odd::kNotInOnePiece, 8},
      {7, 300, Odd::kNotInOnePiece, 8},
      {19, 0, Odd::kChainBroken, 20},
      {19, 10, Odd::kCyclic, 20},
  };
  for (const Case& one : kCases) {
    memset(sector, 0, sizeof sector);
    for (uint8_t i = 0; i < 20; ++i) put_entry(sector, layout, 10 + i, 11U + i);
    put_entry(sector, layout, 29, kEndEntry);
    if (one.next != 0 || one.at != 0) {
      put_entry(sector, layout, static_cast<uint16_t>(10 + one.at), one.next);
    }
    ChainCheck check;
    check.start(10, 20);
    REQUIRE(check.take(sector, layout));
    CHECK_EQ(static_cast<int>(check.state()), static_cast<int>(one.state));
    CHECK_EQ(check.length(), one.length);
  }
}

TEST_CASE("a chain goes on from sector to sector, each looked at once") {
  const Layout layout = small_layout(true, 5000);
  ChainCheck check;
  check.start(100, 1000);
  uint16_t sectors = 0;
  for (;;) {
    const uint32_t base = check.cluster() / 128 * 128;
    for (uint16_t i = 0; i < 128; ++i) put_entry(sector, layout, i, base + i + 1);
    if (base <= 1099 && 1099 < base + 128)
      put_entry(sector, layout, static_cast<uint16_t>(1099 - base), kEndEntry);
    ++sectors;
    if (check.take(sector, layout)) break;
  }
  CHECK_EQ(static_cast<int>(check.state()), static_cast<int>(Odd::kGood));
  CHECK_EQ(sectors, 9);
}

namespace {

// A table in which `used` says of each cluster whether it is free.
template <typename Used>
uint16_t search(FreeRun& run, const Layout& layout, Used used, uint16_t most = 1000) {
  uint16_t sectors = 0;
  while (sectors < most) {
    const uint16_t entries = static_cast<uint16_t>(1U << entries_shift(layout));
    const uint32_t base = run.cluster() & ~static_cast<uint32_t>(entries - 1U);
    for (uint16_t i = 0; i < entries; ++i) {
      put_entry(sector, layout, i, used(base + i) ? kEndEntry : kFreeEntry);
    }
    ++sectors;
    if (run.take(sector, layout)) break;
  }
  return sectors;
}

}  // namespace

TEST_CASE("a free run is found across sectors and the search ends there") {
  const Layout layout = small_layout(true, 5000);
  FreeRun run;
  run.start(layout, 0, layout.clusters, 300);
  const uint16_t sectors = search(run, layout, [](uint32_t c) { return c < 700 || c == 800; });
  CHECK(run.ended());
  CHECK_EQ(run.best().first, 801U);
  CHECK_EQ(run.best().count, 300U);
  CHECK_EQ(sectors, 9);
}

TEST_CASE("a search begins in the middle, goes round once and joins no two ends") {
  const Layout layout = small_layout(false, 5000);
  FreeRun run;
  run.start(layout, 4000, layout.clusters, 3000);
  search(run, layout, [](uint32_t c) { return c >= 1200 && c < 4500; });
  CHECK(run.ended());
  CHECK_EQ(run.best().first, 2U);
  CHECK_EQ(run.best().count, 1198U);
  CHECK_EQ(run.free_clusters(), 1198U + 502U);
  CHECK_EQ(run.looked_at(), 5000U);
}

TEST_CASE("the best so far may be taken and the search goes on behind it") {
  const Layout layout = small_layout(true, 5000);
  FreeRun run;
  run.start(layout, 0, layout.clusters, 1000);
  const auto used = [](uint32_t c) { return c < 100 || (c >= 400 && c < 2000); };
  search(run, layout, used, 5);
  CHECK_EQ(run.best().first, 100U);
  CHECK_EQ(run.best().count, 300U);
  CHECK(!run.best_grows());
  CHECK_EQ(run.take_best(250).first, 100U);
  CHECK_EQ(run.best().first, 350U);
  CHECK_EQ(run.best().count, 50U);
  search(run, layout, used);
  CHECK_EQ(run.best().first, 2000U);
  CHECK_EQ(run.best().count, 1000U);
}

TEST_CASE("what is left of a run grows on with what lies behind it") {
  const Layout layout = small_layout(true, 5000);
  FreeRun run;
  run.start(layout, 0, layout.clusters, 1000);
  const auto used = [](uint32_t c) { return c >= 900; };
  search(run, layout, used, 5);  // to cluster 640
  CHECK(run.best_grows());
  const uint32_t seen = run.best().count;
  CHECK_EQ(run.take_best(250).count, 250U);
  CHECK(run.best_grows());
  CHECK_EQ(run.best().count, seen - 250U);
  search(run, layout, used);
  CHECK_EQ(run.best().first, 252U);
  CHECK_EQ(run.best().count, 900U - 252U);
}

TEST_CASE("a run taken in the midst of a second look is no room a second time") {
  const Layout layout = small_layout(true, 5000);
  FreeRun run;
  run.start(layout, 3, 600, 1000);
  search(run, layout, [](uint32_t c) { return c >= 500; });
  CHECK_EQ(run.best().count, 497U);
  run.go_on_from(layout, 3);
  search(
      run, layout, [](uint32_t c) { return c >= 500; }, 1);
  CHECK_EQ(run.take_best(300).first, 3U);
  search(run, layout, [](uint32_t c) { return c < 303 || c >= 500; });
  CHECK_EQ(run.best().first, 303U);
  CHECK_EQ(run.best().count, 197U);
}

TEST_CASE("a run linked and freed, from the back, in every copy") {
  const Layout layout = small_layout(true, 5000);
  ChainEdit edit;
  edit.start(Edit::kLink, 120, 300);
  uint32_t before = 0xFFFFFFFFU;
  uint8_t writes = 0;
  bool on = true;
  while (on) {
    memset(sector, 0, sizeof sector);
    const uint32_t lba = edit.lba(layout);
    CHECK(lba < before);
    before = lba;
    REQUIRE(edit.edit(sector, layout));
    if (lba == 100U + 2U) {
      CHECK_EQ(entry(sector, layout, 300 - 256), kEndEntry);
      CHECK_EQ(entry(sector, layout, 301 - 256), kFreeEntry);
    }
    if (lba == 100U) {
      CHECK_EQ(entry(sector, layout, 119), kFreeEntry);
      CHECK_EQ(entry(sector, layout, 120), 121U);
    }
    CHECK_EQ(edit.to_lba(layout), lba + 50U);
    ++writes;
    CHECK(edit.written(layout) == ChainEdit::Next::kCopy);
    CHECK_EQ(edit.to_lba(layout), lba);
    ++writes;
    on = edit.written(layout) == ChainEdit::Next::kSector;
  }
  CHECK_EQ(writes, 6);
  // What is not free is not linked.
  memset(sector, 0, sizeof sector);
  put_entry(sector, layout, 125, 9);
  edit.start(Edit::kLink, 120, 127);
  CHECK(!edit.edit(sector, layout));
  edit.start(Edit::kTrim, 120, 127);
  REQUIRE(edit.edit(sector, layout));
  CHECK_EQ(entry(sector, layout, 120), kEndEntry);
  CHECK_EQ(entry(sector, layout, 121), kFreeEntry);
  CHECK_EQ(edit.next_free(), 121U);
}

TEST_CASE("the folder's newest flight file and its free entry") {
  memset(sector, 0, sizeof sector);
  make_entry(sector, 0, 41, 0x12345, 512, 0x5C210000);
  CHECK_EQ(memcmp(sector, "FLT00041BIN\x20", 12), 0);
  CHECK_EQ(sector[32], 0);
  make_entry(sector, 1, 7, 99, 1024, 0);
  make_entry(sector, 2, 50, 99, 1024, 0);
  sector[64] = 0xE5;  // deleted
  make_entry(sector, 3, 60, 99, 1024, 0);
  sector[96 + 11] = 0x0F;  // a piece of a long name
  make_entry(sector, 4, 55, 99, 1024, 0);
  sector[128 + 9] = 'X';
  FolderWalk walk = {};
  CHECK(walk.take(sector, 777));
  CHECK_EQ(walk.number, 41U);
  CHECK_EQ(walk.newest.lba, 777U);
  CHECK_EQ(walk.newest.index, 0);
  CHECK_EQ(walk.free.index, 2);
  const Entry found = read_entry(sector, 0, true);
  CHECK_EQ(found.cluster, 0x12345U);
  CHECK_EQ(found.bytes, 512U);
  CHECK_EQ(read_entry(sector, 0, false).cluster, 0x2345U);
  set_size(sector, 0, 4096, 0x5C210000);
  set_cluster(sector, 0, 0x54321);
  CHECK_EQ(read_entry(sector, 0, true).cluster, 0x54321U);
  CHECK_EQ(read_entry(sector, 0, true).bytes, 4096U);
  for (uint8_t index = 0; index < 16; ++index) make_entry(sector, index, index + 1U, 5, 0, 0);
  FolderWalk full = {};
  CHECK(!full.take(sector, 5));
  CHECK_EQ(full.free.lba, 0U);
  CHECK_EQ(full.number, 16U);
}

namespace {

// Block `number` of a file whose used part is `used` blocks with `holes` before its end; the last
// of them ends the session. The others are of an older file, valid and at the same places.
void block_of(uint32_t number, uint32_t used, uint32_t hole) {
  const bool own = number < used && number != hole;
  core::BlockHeader header = {};
  header.file_id = own ? 0xC0FFEE : 0xBAD;
  header.session = own ? 9 : 3;
  header.sequence = number;
  build_end_block(sector, header, {1, 12, 4096 * 512UL});
}

FlightFile ended_file(uint32_t blocks, uint32_t used, uint32_t hole, uint16_t& looks) {
  FlightFile file;
  file.blocks = blocks;
  EndSearch search;
  search.start(blocks);
  looks = 0;
  do {
    block_of(search.block(), used, hole);
    ++looks;
  } while (!search.take(sector, file));
  return file;
}

}  // namespace

TEST_CASE("the end of a file among valid blocks of an older one") {
  static const uint16_t kUsed[] = {1, 2, 3, 500, 998, 999, 1000};
  for (const uint16_t used : kUsed) {
    uint16_t looks = 0;
    const FlightFile file = ended_file(1000, used, 5000, looks);
    CHECK_EQ(file.next_block, used);
    CHECK_EQ(file.last_session, 9U);
    CHECK_EQ(file.made_bytes, 4096UL * 512UL);
    CHECK(file.ended);
    CHECK(looks < 90);
  }
  uint16_t looks = 0;
  CHECK_EQ(ended_file(1000, 700, 500, looks).next_block, 700U);  // a hole where it looks first
  CHECK_EQ(ended_file(1000, 700, 698, looks).next_block, 700U);
  CHECK(looks < 180);
}
