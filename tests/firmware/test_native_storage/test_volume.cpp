// Whole jobs of storage on a card in memory: what is written, what a power cut leaves, and that no
// content of a card stops the recorder.
#include <string.h>

#include <algorithm>
#include <vector>

#include "check.h"
#include "core/bytes.h"
#include "hal/block_device.h"
#include "random_numbers.h"
#include "storage/block_build.h"
#include "storage/fat_sector.h"
#include "storage/volume.h"

namespace {

using namespace storage;
using core::get_le;
using core::put_le;
using hal::CardStatus;
using Odd = frames::FileState;
using Job = Volume::Job;
using Image = std::vector<uint8_t>;

constexpr uint32_t kReserved = 32;
constexpr uint32_t kFatSectors = 24;
constexpr uint32_t kClusters = 3000;
constexpr uint32_t kDataLba = kReserved + 2 * kFatSectors;
constexpr uint32_t kFileBlocks = 1500;

// ---- the card under hal ----
struct RamCard {
  Image image;
  uint32_t lba = 0;
  uint32_t reads = 0;
  uint32_t writes = 0;
  uint32_t cut_at = UINT32_MAX;  // this write and all behind it are not done
  bool garbage = false;          // but this one leaves garbage
  uint8_t busy = 0;
} card;

uint32_t image_blocks() {
  return static_cast<uint32_t>(card.image.size() / 512);
}

}  // namespace

namespace hal {
void start_card() {}
CardStatus poll_start() {
  return card.image.empty() ? CardStatus::kAbsent : CardStatus::kOk;
}
void begin_read(uint32_t lba) {
  card.lba = lba;
  card.busy = 2;
}
CardStatus poll_read(uint8_t* block) {
  if (card.busy-- != 0) return CardStatus::kBusy;
  ++card.reads;
  memcpy(block, &card.image[card.lba * 512U], 512);
  return CardStatus::kOk;
}
void begin_write(uint32_t lba) {
  card.lba = lba;
  card.busy = 2;
}
CardStatus poll_write(const uint8_t* block) {
  if (card.busy-- != 0) return CardStatus::kBusy;
  uint8_t* const to = &card.image[card.lba * 512U];
  if (card.writes < card.cut_at) memcpy(to, block, 512);
  if (card.writes == card.cut_at && card.garbage) {
    Random random(card.writes + 1);
    for (uint16_t i = 0; i < 512; ++i) to[i] = random.byte();
  }
  ++card.writes;
  return CardStatus::kOk;
}
CardStatus read_card_id(uint8_t* id) {
  memset(id, 0x5A, kCardIdBytes);
  return CardStatus::kOk;
}
uint32_t card_blocks() {
  return image_blocks();
}
}  // namespace hal

namespace {

// An empty FAT32 with clusters of one block.
Image new_card() {
  Image image((kDataLba + kClusters) * 512U);
  uint8_t* const boot = image.data();
  boot[0] = 0xEB;
  put_le<uint16_t>(boot + 11, 512);
  boot[13] = 1;
  put_le<uint16_t>(boot + 14, kReserved);
  boot[16] = 2;
  put_le<uint32_t>(boot + 32, kDataLba + kClusters);
  put_le<uint32_t>(boot + 36, kFatSectors);
  put_le<uint32_t>(boot + 44, 2);
  put_le<uint16_t>(boot + 48, 1);
  put_le<uint16_t>(boot + 510, 0xAA55);
  uint8_t* const info = boot + 512;
  put_le<uint32_t>(info, 0x41615252U);
  put_le<uint32_t>(info + 484, 0x61417272U);
  put_info(info, kClusters - 1, 3);
  put_le<uint16_t>(info + 510, 0xAA55);
  for (uint8_t copy = 0; copy < 2; ++copy) {
    uint8_t* const fat = boot + (kReserved + copy * kFatSectors) * 512U;
    put_le<uint32_t>(fat, 0x0FFFFFF8U);
    put_le<uint32_t>(fat + 4, kEndEntry);
    put_le<uint32_t>(fat + 8, kEndEntry);
  }
  return image;
}

uint32_t fat(uint32_t cluster, uint8_t copy = 0) {
  const uint32_t at = (kReserved + copy * kFatSectors) * 512U + 4U * cluster;
  return get_le<uint32_t>(&card.image[at]) & 0x0FFFFFFFU;
}

void set_fat(uint32_t cluster, uint32_t value) {
  for (uint8_t copy = 0; copy < 2; ++copy) {
    put_le<uint32_t>(&card.image[(kReserved + copy * kFatSectors) * 512U + 4U * cluster], value);
  }
}

uint8_t* folder_entry(uint8_t index) {
  return &card.image[kDataLba * 512U + index * 32U];
}

uint8_t sector[512];

// Steps until the job ends; every one is bounded by the count of a card read a few times.
bool finish(Volume& volume) {
  const uint32_t before = card.reads;
  for (uint32_t steps = 0; steps < 400000; ++steps) {
    if (volume.step(sector, true)) return card.reads - before < 20000;
  }
  return false;
}

struct Recorded {
  Volume volume;
  Recorded() { volume.set_file_blocks(kFileBlocks); }
  bool look() {
    volume.look();
    return finish(volume);
  }
  bool prepare(uint32_t session) {
    volume.search();
    if (!finish(volume)) return false;
    volume.make(session, kFileBlocks, false);
    return finish(volume);
  }
  // Blocks of a session as the stream would write them; the last names the file's room.
  void record(uint32_t blocks) {
    const FlightFile& file = volume.file();
    for (uint32_t n = 1; n < blocks; ++n) {
      core::BlockHeader header = {};
      header.file_id = file.file_id;
      header.session = file.last_session;
      header.sequence = n;
      build_end_block(sector, header, {n, file.number, file.blocks * 512U});
      memcpy(&card.image[(file.first_lba + n) * 512U], sector, 512);
    }
  }
};

void insert(const Image& image) {
  card = RamCard();
  card.image = image;
}

// Both copies alike; every chain ends; clusters in use are those of files and the folder.
uint32_t clusters_in_use() {
  uint32_t used = 0;
  for (uint32_t cluster = 2; cluster < kClusters + 2; ++cluster) used += fat(cluster) != 0;
  return used;
}

bool copies_alike() {
  const auto first = card.image.begin() + kReserved * 512L;
  return std::equal(first, first + kFatSectors * 512L, first + kFatSectors * 512L);
}

// A card with a flight of 700 blocks that was closed, and another that was not.
Image flown(uint32_t open_blocks) {
  insert(new_card());
  Recorded one;
  one.look();
  one.prepare(1);
  one.record(700);
  one.volume.close(700, false, 0);
  finish(one.volume);
  one.volume.look_again();
  finish(one.volume);
  one.prepare(2);
  one.record(open_blocks);
  return card.image;
}

}  // namespace

TEST_CASE("a file is one run in both copies, with a block of its own, and FSInfo counts it") {
  insert(new_card());
  Recorded one;
  REQUIRE(one.look());
  CHECK(one.volume.state() == FileState::kNone);
  REQUIRE(one.prepare(7));
  REQUIRE(one.volume.status() == VolumeStatus::kReady);
  const FlightFile& file = one.volume.file();
  CHECK_EQ(file.number, 1U);
  CHECK_EQ(file.blocks, kFileBlocks);
  CHECK(copies_alike());
  CHECK_EQ(clusters_in_use(), kFileBlocks + 1);
  CHECK_EQ(get_le<uint32_t>(&card.image[512 + 488]), kClusters - 1 - kFileBlocks);
  CHECK_EQ(memcmp(folder_entry(0), "FLT00001BIN", 11), 0);
  CHECK_EQ(read_entry(folder_entry(0), 0, true).bytes, kFileBlocks * 512U);
  core::BlockHeader header;
  CHECK(core::check_block(&card.image[file.first_lba * 512U], header) == core::BlockVerdict::kOk);
  CHECK_EQ(header.session, 7U);
  Recorded again;
  REQUIRE(again.look());
  CHECK(again.volume.state() == FileState::kBlank);
  CHECK_EQ(again.volume.file().file_id, file.file_id);
}

TEST_CASE("no write is begun while it is not the ground, and it goes on where it stood") {
  insert(new_card());
  Recorded one;
  REQUIRE(one.look());
  one.volume.search();
  REQUIRE(finish(one.volume));
  one.volume.make(1, kFileBlocks, false);
  for (uint16_t steps = 0; steps < 1000; ++steps) CHECK(!one.volume.step(sector, false));
  CHECK_EQ(card.writes, 0U);
  CHECK(one.volume.waits());
  for (uint16_t steps = 0; steps < 20; ++steps) one.volume.step(sector, true);
  const uint32_t before = card.writes;
  CHECK(before > 0U);
  for (uint16_t steps = 0; steps < 1000; ++steps) one.volume.step(sector, false);
  CHECK(card.writes <= before + 1);
  REQUIRE(finish(one.volume));
  CHECK(one.volume.status() == VolumeStatus::kReady);
}

TEST_CASE("a closed file is as long as what it holds, and the rest is free") {
  const Image image = flown(300);
  insert(image);
  Recorded one;
  REQUIRE(one.look());
  REQUIRE(one.volume.state() == FileState::kOpen);
  CHECK_EQ(one.volume.file().next_block, 300U);
  CHECK_EQ(one.volume.file().number, 2U);
  one.volume.close(300, true, 5);
  REQUIRE(finish(one.volume));
  CHECK(copies_alike());
  CHECK_EQ(clusters_in_use(), 1U + 700U + 301U);
  CHECK_EQ(get_le<uint32_t>(&card.image[512 + 488]), kClusters - 1002);
  Recorded again;
  REQUIRE(again.look());
  CHECK(again.volume.state() == FileState::kClosed);
  CHECK(again.volume.odd() == Odd::kGood);
  CHECK(again.volume.file().ended);
  CHECK_EQ(again.volume.file().made_bytes, kFileBlocks * 512U);
}

TEST_CASE("a small file is given more room, and what it had is free") {
  insert(new_card());
  for (uint32_t c = 1000; c < 3002; ++c) set_fat(c, kEndEntry);
  Recorded one;
  REQUIRE(one.look());
  REQUIRE(one.prepare(1));
  CHECK_EQ(one.volume.file().blocks, 997U);
  for (uint32_t c = 1000; c < 3002; ++c) set_fat(c, kFreeEntry);
  one.volume.search();
  REQUIRE(finish(one.volume));
  one.volume.make(1, kFileBlocks, true);
  REQUIRE(finish(one.volume));
  CHECK_EQ(one.volume.file().blocks, kFileBlocks);
  CHECK_EQ(one.volume.file().number, 1U);
  CHECK_EQ(clusters_in_use(), kFileBlocks + 1);
  Recorded again;
  REQUIRE(again.look());
  CHECK(again.volume.state() == FileState::kBlank);
  CHECK_EQ(again.volume.file().blocks, kFileBlocks);
}

TEST_CASE("a search that was left for a small file goes on at its own sector") {
  insert(new_card());
  for (uint32_t c = 512; c < 640; ++c) set_fat(c, kEndEntry);  // a sector of the table
  Recorded one;
  REQUIRE(one.look());
  one.volume.search();
  while (one.volume.best_blocks() != 509) REQUIRE(!one.volume.step(sector, true));
  while (!one.volume.leave()) one.volume.step(sector, true);
  one.volume.make(1, 200, false);
  REQUIRE(finish(one.volume));
  CHECK_EQ(one.volume.file().blocks, 200U);
  one.volume.go_on_searching();
  REQUIRE(finish(one.volume));
  one.volume.make(1, kFileBlocks, true);
  REQUIRE(finish(one.volume));
  CHECK(one.volume.status() == VolumeStatus::kReady);
  CHECK_EQ(one.volume.file().first_lba, kDataLba + 640U - 2U);
  CHECK_EQ(one.volume.file().blocks, kFileBlocks);
  CHECK_EQ(clusters_in_use(), kFileBlocks + 1 + 128);
}

namespace {

// The next boot records: it looks, mends, closes what is open, prepares.
bool next_boot_records(Recorded& boot) {
  if (!boot.look() || boot.volume.status() != VolumeStatus::kReady) return false;
  if (boot.volume.state() == FileState::kOpen) {
    boot.volume.close(boot.volume.file().next_block, !boot.volume.file().ended, 0);
    if (!finish(boot.volume) || boot.volume.status() != VolumeStatus::kReady) return false;
    boot.volume.look_again();
    if (!finish(boot.volume)) return false;
  }
  if (boot.volume.can_mend()) {
    boot.volume.mend();
    if (!finish(boot.volume) || boot.volume.status() != VolumeStatus::kReady) return false;
  }
  if (boot.volume.state() == FileState::kBlank) return true;
  return boot.prepare(9) && boot.volume.status() == VolumeStatus::kReady;
}

uint32_t whole_blocks(uint32_t session) {
  uint32_t found = 0;
  core::BlockHeader header;
  for (uint32_t lba = kDataLba; lba < image_blocks(); ++lba) {
    const uint8_t* const block = &card.image[lba * 512U];
    if (core::check_block(block, header) != core::BlockVerdict::kOk) continue;
    found += header.session == session;
  }
  return found;
}

// A file's chain as a PC follows it: as long as its size, no longer.
bool readable(uint8_t index) {
  const Entry entry = read_entry(folder_entry(index), 0, true);
  uint32_t cluster = entry.cluster;
  for (uint32_t left = entry.bytes / 512; left > 1; --left) {
    if (cluster < 2 || cluster >= kClusters + 2) return false;
    cluster = fat(cluster);
  }
  return entry.bytes > 0 && fat(cluster) >= kLeastEndEntry;
}

// One run of 997 clusters, a file of 200 in it; another run from `other` on.
Image small_in_a_run(uint32_t other = 2 + kClusters) {
  insert(new_card());
  for (uint32_t c = 1000; c < other; ++c) set_fat(c, kEndEntry);
  Recorded one;
  one.look();
  one.volume.search();
  finish(one.volume);
  one.volume.make(1, 200, false);
  finish(one.volume);
  return card.image;
}
constexpr uint32_t kBesideRun = 1 + kClusters + 2 - 1000;

}  // namespace

TEST_CASE("a small file grows where it stands: the whole run is its own") {
  insert(new_card());
  for (uint32_t c = 1000; c < 2 + kClusters; ++c) set_fat(c, kEndEntry);
  Recorded one;
  REQUIRE(one.look());
  one.volume.search();
  REQUIRE(finish(one.volume));
  CHECK_EQ(one.volume.best_blocks(), 997U);
  one.volume.make(1, 200, false);
  REQUIRE(finish(one.volume));
  const FlightFile small = one.volume.file();
  one.volume.go_on_searching();
  CHECK(one.volume.job() == Volume::Job::kNone);  // all is looked at
  CHECK_EQ(one.volume.best_blocks(), 997U);
  one.volume.make(1, kFileBlocks, true);
  REQUIRE(finish(one.volume));
  const FlightFile& file = one.volume.file();
  CHECK_EQ(file.blocks, 997U);
  CHECK_EQ(file.number, 1U);
  CHECK_EQ(file.first_lba, small.first_lba);
  CHECK_EQ(file.file_id, small.file_id);
  CHECK_EQ(clusters_in_use(), kBesideRun + 997U);
  CHECK(copies_alike());
  CHECK(readable(0));
  CHECK_EQ(get_le<uint32_t>(&card.image[512 + 488]), kClusters - 1 - 997);
}

TEST_CASE("a small file with room for a whole one behind it grows without a further search") {
  insert(new_card());
  Recorded one;
  REQUIRE(one.look());
  one.volume.search();
  REQUIRE(finish(one.volume));
  one.volume.make(1, 200, false);
  REQUIRE(finish(one.volume));
  one.volume.go_on_searching();
  CHECK(one.volume.job() == Volume::Job::kNone);
  CHECK_EQ(one.volume.best_blocks(), kFileBlocks);
  one.volume.make(1, kFileBlocks, true);
  REQUIRE(finish(one.volume));
  CHECK_EQ(one.volume.file().blocks, kFileBlocks);
  CHECK_EQ(clusters_in_use(), 1U + kFileBlocks);
  CHECK(readable(0));
}

TEST_CASE("a small file of the power-on before grows too, and keeps its session") {
  const Image image = small_in_a_run();
  insert(image);
  Recorded one;
  REQUIRE(one.look());
  REQUIRE(one.volume.state() == FileState::kBlank);
  one.volume.search();
  REQUIRE(finish(one.volume));
  one.volume.make(7, kFileBlocks, true);
  REQUIRE(finish(one.volume));
  CHECK_EQ(one.volume.file().blocks, 997U);
  CHECK_EQ(one.volume.file().last_session, 1U);
  one.record(500);
  Recorded again;
  REQUIRE(again.look());
  CHECK(again.volume.state() == FileState::kOpen);
  CHECK_EQ(again.volume.file().next_block, 500U);
}

TEST_CASE("growing is left at any step: what is recorded is closed and readable") {
  const Image image = small_in_a_run();
  uint32_t left_at = 0;
  for (bool ended = false; !ended; left_at += 3) {
    insert(image);
    Recorded one;
    REQUIRE(one.look());
    one.volume.search();
    REQUIRE(finish(one.volume));
    one.volume.make(1, kFileBlocks, true);
    for (uint32_t step = 0; step < left_at && !ended; ++step) {
      ended = one.volume.step(sector, true);
    }
    while (!one.volume.leave()) one.volume.step(sector, true);
    const uint32_t blocks = one.volume.file().blocks;
    CHECK((blocks == 200U || blocks == 997U));
    one.record(150);
    Recorded boot;
    REQUIRE(next_boot_records(boot));
    CHECK_EQ(boot.volume.file().number, 2U);
    CHECK_EQ(whole_blocks(1), 150U);
    CHECK(readable(0));
    CHECK(copies_alike());
  }
  CHECK(left_at > 30);
}

namespace {

// Cuts at every write of `work` on `image`; `judge` sees the card behind the next boot.
template <typename Work, typename Judge>
uint32_t cut_everywhere(const Image& image, Work work, Judge judge) {
  insert(image);
  work();
  const uint32_t writes = card.writes;
  for (uint32_t cut = 0; cut < writes; ++cut) {
    for (uint8_t garbage = 0; garbage < 2; ++garbage) {
      insert(image);
      card.cut_at = cut;
      card.garbage = garbage != 0;
      work();
      card.cut_at = UINT32_MAX;
      Recorded boot;
      CHECK(next_boot_records(boot));
      judge(garbage != 0);
    }
  }
  return writes;
}

}  // namespace

TEST_CASE("power cut at every write of preparing: the next boot records, nothing is lost") {
  const Image image = flown(300);
  insert(image);
  Recorded one;
  REQUIRE(one.look());
  one.volume.close(300, true, 5);
  REQUIRE(finish(one.volume));
  const Image closed = card.image;
  const uint32_t writes = cut_everywhere(
      closed,
      [] {
        Recorded boot;
        boot.look();
        boot.prepare(3);
      },
      [](bool garbage) {
        CHECK_EQ(whole_blocks(1), 700U);
        CHECK_EQ(whole_blocks(2), 301U);
        if (garbage) return;
        CHECK(readable(0));
        CHECK(readable(1));
        CHECK(clusters_in_use() <= 1U + 700U + 301U + 2 * kFileBlocks);
      });
  CHECK(writes > 20);
}

TEST_CASE("power cut at every write of growing: the next boot records") {
  const uint32_t writes = cut_everywhere(
      small_in_a_run(2400),
      [] {
        Recorded boot;
        boot.look();
        boot.volume.search();
        finish(boot.volume);
        boot.volume.make(3, kFileBlocks, true);
        finish(boot.volume);
      },
      [](bool garbage) {
        if (garbage) return;
        CHECK(clusters_in_use() <= kBesideRun + 997U);
        Recorded boot;
        CHECK(boot.look());
        CHECK(boot.volume.state() == FileState::kBlank);
        CHECK(boot.volume.file().blocks >= 200U);
      });
  CHECK(writes > 10);
}

TEST_CASE("power cut at every write of closing: the next boot mends, nothing is lost") {
  const uint32_t writes = cut_everywhere(
      flown(300),
      [] {
        Recorded boot;
        boot.look();
        boot.volume.close(300, true, 5);
        finish(boot.volume);
      },
      [](bool garbage) {
        CHECK_EQ(whole_blocks(1), 700U);
        CHECK(whole_blocks(2) >= 300U);
        CHECK(whole_blocks(2) <= 301U);
        if (garbage) return;
        CHECK(copies_alike());
        CHECK(readable(0));
        CHECK(readable(1));
        // The flight's end was told already: the boot behind a cut may do without a block for it.
        CHECK(clusters_in_use() >= 1U + 700U + 300U + kFileBlocks);
        CHECK(clusters_in_use() <= 1U + 700U + 301U + kFileBlocks);
      });
  CHECK(writes > 20);
}

TEST_CASE("a size that exceeds its chain, as images before cut it, is mended") {
  insert(flown(300));
  Recorded one;
  REQUIRE(one.look());
  const uint32_t first = one.volume.file().first_lba - kDataLba + 2;
  set_fat(first + 299, kEndEntry);
  for (uint32_t c = first + 300; c < first + kFileBlocks; ++c) set_fat(c, kFreeEntry);
  REQUIRE(one.look());
  CHECK(one.volume.state() == FileState::kClosed);
  CHECK(one.volume.odd() == Odd::kChainShort);
  REQUIRE(one.volume.can_mend());
  one.volume.mend();
  REQUIRE(finish(one.volume));
  CHECK(readable(1));
  CHECK_EQ(read_entry(folder_entry(1), 0, true).bytes, 300U * 512U);
}

TEST_CASE("a chain behind the end that may be another file's is left alone") {
  insert(flown(300));
  Recorded one;
  REQUIRE(one.look());
  one.volume.close(300, true, 5);
  REQUIRE(finish(one.volume));
  const uint32_t first = one.volume.file().first_lba - kDataLba + 2;
  // The end of ours is altered so that it runs into a stranger's file of three clusters.
  set_fat(first + 300, first + 301);
  set_fat(first + 301, first + 302);
  set_fat(first + 302, first + 303);
  set_fat(first + 303, kEndEntry);
  REQUIRE(one.look());
  REQUIRE(one.volume.can_mend());
  one.volume.mend();
  REQUIRE(finish(one.volume));
  CHECK_EQ(fat(first + 302), first + 303);
}

TEST_CASE("whatever the newest file is, the next number is taken") {
  struct Change {
    Odd odd;
    void (*make)(uint8_t* entry, uint32_t first);
  };
  static const Change kChanges[] = {
      {Odd::kNotAFile, [](uint8_t* e, uint32_t) { e[11] = 0x10; }},
      {Odd::kReadOnly, [](uint8_t* e, uint32_t) { e[11] = 0x21; }},
      {Odd::kOutOfRange, [](uint8_t* e, uint32_t) { put_le<uint16_t>(e + 20, 0x0FFF); }},
      {Odd::kOutOfRange, [](uint8_t* e, uint32_t) { put_le<uint32_t>(e + 28, 0xFFFFFFFFU); }},
      {Odd::kOutOfRange, [](uint8_t* e, uint32_t) { put_le<uint16_t>(e + 26, 1); }},
      {Odd::kChainBroken, [](uint8_t*, uint32_t first) { set_fat(first + 40, kFreeEntry); }},
      {Odd::kChainBroken, [](uint8_t*, uint32_t first) { set_fat(first, 0x0FFFFFF7); }},
      {Odd::kChainShort, [](uint8_t*, uint32_t first) { set_fat(first + 40, kEndEntry); }},
      {Odd::kCyclic, [](uint8_t*, uint32_t first) { set_fat(first + 1400, first); }},
      {Odd::kCyclic, [](uint8_t*, uint32_t first) { set_fat(first, first); }},
      {Odd::kNotInOnePiece, [](uint8_t*, uint32_t first) { set_fat(first + 700, 5); }},
  };
  const Image image = flown(300);
  for (const Change& change : kChanges) {
    insert(image);
    Recorded one;
    REQUIRE(one.look());
    change.make(folder_entry(1), one.volume.file().first_lba - kDataLba + 2);
    REQUIRE(one.look());
    CHECK(one.volume.status() == VolumeStatus::kReady);
    CHECK(one.volume.state() == FileState::kClosed);
    CHECK_EQ(static_cast<int>(one.volume.odd()), static_cast<int>(change.odd));
    one.volume.set_file_blocks(500);
    REQUIRE(one.prepare(4));
    CHECK(one.volume.status() == VolumeStatus::kReady);
    CHECK_EQ(one.volume.file().number, 3U);
  }
}

TEST_CASE("a root folder in a ring, or with a broken chain, is left and recorded into") {
  for (uint8_t kind = 0; kind < 3; ++kind) {
    insert(new_card());
    set_fat(2, kind == 0 ? 2 : kind == 1 ? 2500 : 0x0FFFFFF0);
    if (kind == 1) {
      set_fat(2500, 2501);
      set_fat(2501, 2500);
    }
    for (uint8_t index = 0; index < 16; ++index) {
      memset(folder_entry(index), 'A', 32);
      folder_entry(index)[0] = index == 3 ? 0xE5 : 'A';
      for (uint32_t cluster = 2500; cluster < 2502; ++cluster) {
        card.image[(kDataLba + cluster - 2) * 512U + index * 32U] = 'B';
      }
    }
    Recorded one;
    REQUIRE(one.look());
    CHECK(one.volume.odd() == Odd::kFolderBroken);
    REQUIRE(one.prepare(1));
    CHECK(one.volume.status() == VolumeStatus::kReady);
    CHECK_EQ(memcmp(folder_entry(3), "FLT00001BIN", 11), 0);
  }
}

TEST_CASE("a full root folder gets another cluster") {
  insert(new_card());
  for (uint8_t index = 0; index < 16; ++index) {
    make_entry(folder_entry(0), index, index + 1U, 0, 0, 0);
  }
  Recorded one;
  REQUIRE(one.look());
  REQUIRE(one.prepare(1));
  REQUIRE(one.volume.status() == VolumeStatus::kReady);
  CHECK(copies_alike());
  CHECK_EQ(clusters_in_use(), 2U + kFileBlocks);
  CHECK(fat(fat(2)) >= kLeastEndEntry);
  Recorded again;
  REQUIRE(again.look());
  CHECK_EQ(again.volume.file().number, 17U);
  CHECK(again.volume.state() == FileState::kBlank);
}

TEST_CASE("cards altered at random: every job ends, within the bounds") {
  Random random(20);
  const Image image = flown(300);
  uint32_t mounted = 0;
  uint32_t prepared = 0;
  constexpr uint32_t kRounds = 1500;
  for (uint32_t round = 0; round < kRounds; ++round) {
    insert(image);
    for (uint16_t changes = static_cast<uint16_t>(random.below(6) + 1); changes != 0; --changes) {
      const uint16_t kind = random.below(10);
      uint32_t at = 0;
      if (kind == 0) at = random.below(90);                                // boot sector
      if (kind == 1) at = 512 + 480 + random.below(32);                    // FSInfo
      if (kind >= 2 && kind < 6) at = kDataLba * 512U + random.below(96);  // folder
      if (kind >= 6) at = (kReserved + random.below(2 * kFatSectors)) * 512U + random.below(512);
      card.image[at] = kind == 9 ? 0xFF : random.byte();
      if (kind == 8) {
        for (uint16_t i = 0; i < 512; ++i) card.image[at / 512 * 512 + i] = random.byte();
      }
    }
    Recorded one;
    CHECK(one.look());
    if (one.volume.status() != VolumeStatus::kReady) continue;
    ++mounted;
    prepared += next_boot_records(one);
    CHECK(one.volume.job() == Job::kNone);
  }
  CHECK(mounted > kRounds * 7 / 10);
  CHECK(prepared > kRounds / 2);
}
