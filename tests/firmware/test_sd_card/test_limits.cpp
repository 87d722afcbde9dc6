// The life of a card at its limits: each wait from both sides, each command refused, each bit of
// the capacity where the specification has it.
#include <string.h>

#include "check.h"
#include "drivers/sd_card.h"
#include "model_card.h"

namespace {

using drivers::CardStatus;
using drivers::CardStep;

uint8_t block[512];

struct Life {
  ModelCard model;
  drivers::SdCard<ModelCard> card{model};
  uint32_t took_us = 0;

  bool start() {
    const uint32_t from_us = model.now_us();
    card.start();
    while (card.poll()) {
      model.advance_us(200);
    }
    took_us = model.now_us() - from_us;
    return card.initialised();
  }
  CardStep finish(bool reads, uint32_t sector) {
    const uint32_t from_us = model.now_us();
    card.begin_block_at(sector);
    CardStep step = CardStep::kAgain;
    while (step == CardStep::kAgain) {
      step = reads ? card.read(block) : card.write(block);
      took_us = model.now_us() - from_us;
      model.advance_us(200);
    }
    return step;
  }
  bool took(uint32_t least_us, uint32_t more_us) const {
    return took_us > least_us && took_us < least_us + more_us;
  }
};

// Bits of a CSD as the specification numbers them: 127 is the highest of the first byte.
void put_bits(uint8_t* csd, uint8_t lowest, uint8_t width, uint32_t value) {
  for (uint8_t i = 0; i < width; ++i) {
    const uint8_t bit = static_cast<uint8_t>(lowest + i);
    uint8_t& byte = csd[15 - bit / 8];
    const uint8_t mask = static_cast<uint8_t>(1U << bit % 8);
    byte = static_cast<uint8_t>((value >> i & 1U) != 0 ? byte | mask : byte & ~mask);
  }
}

// Sectors of a card with that CSD; 0: it is refused as of another kind.
uint32_t sectors_of(const uint8_t* csd) {
  Life life;
  life.model.csd = csd;
  if (!life.start()) {
    CHECK(life.card.status() == CardStatus::kUnsupported);
    return 0;
  }
  return life.card.sectors();
}

}  // namespace

TEST_CASE("card: whichever command of the start is refused, it ends and says so") {
  const uint8_t commands[] = {59, 41, 58, 16, 10, 9};
  for (const uint8_t index : commands) {
    Life life;
    life.model.high_capacity = index != 16;  // only bytes need a block length
    life.model.refuses = index;
    CHECK(!life.start());
    CHECK(life.card.status() == CardStatus::kCommand);
    // And is started anew.
    life.model.refuses = 0xFF;
    CHECK(life.start());
    CHECK(life.card.status() == CardStatus::kOk);
  }
}

TEST_CASE("card: one that still programs is asked nothing, then reset once") {
  for (uint8_t wraps = 0; wraps < 2; ++wraps) {
    Life life;
    if (wraps == 0) life.model.advance_us(100000);  // the clock begins shortly before its end
    life.model.leave_busy(2000);
    CHECK(life.start());
    CHECK_EQ(life.model.resets, 1);
    CHECK_EQ(life.model.bad_commands, 0);
  }
}

TEST_CASE("card: one that programs for ever is reset behind a second") {
  Life dead;
  dead.model.leave_busy(0xFFFF);
  const uint32_t from_us = dead.model.now_us();
  dead.card.start();
  while (dead.card.poll() && dead.model.resets == 0) {
    dead.model.advance_us(200);
  }
  CHECK_EQ(dead.model.resets, 1);
  CHECK(dead.model.now_us() - from_us > 1000000U);
  CHECK(dead.model.now_us() - from_us < 1003000U);
}

TEST_CASE("card: the answer to CMD8 repeats its pattern and names 3.3 V") {
  const struct {
    uint8_t volts, echo;
    bool good;
  } answers[] = {{1, 0xAA, true},
                 {0x11, 0xAA, true},
                 {0xF1, 0xAA, true},
                 {0, 0xAA, false},
                 {2, 0xAA, false},
                 {3, 0xAA, false},
                 {9, 0xAA, false},
                 {1, 0xAB, false},
                 {1, 0x2A, false},
                 {1, 0x00, false}};
  for (const auto& one : answers) {
    Life life;
    life.model.volts = one.volts;
    life.model.echo = one.echo;
    CHECK_EQ(life.start(), one.good);
    CHECK(life.card.status() == (one.good ? CardStatus::kOk : CardStatus::kVoltage));
  }
}

TEST_CASE("card: none is told behind half a second, one that is never ready behind one") {
  for (uint8_t there = 0; there < 2; ++there) {
    Life life;
    life.model.present = there != 0;
    life.model.negotiations = 0xFFFF;
    CHECK(!life.start());
    CHECK(life.took(there != 0 ? 1000000 : 500000, there != 0 ? 20000 : 3000));
  }
}

TEST_CASE("card: a register or a block that does not come within 150 ms") {
  const uint8_t registers[] = {10, 9};
  for (const uint8_t index : registers) {
    Life life;
    life.model.silent = index;
    CHECK(!life.start());
    CHECK(life.card.status() == CardStatus::kReadToken);
    CHECK(life.took(150000, 20000));  // behind all that comes before it
  }
  Life life;
  REQUIRE(life.start());
  life.model.silent = 17;
  CHECK(life.finish(true, 1) == CardStep::kFailed);
  CHECK(life.card.status() == CardStatus::kReadToken);
  CHECK(life.took(150000, 1500));
  life.model.silent = 0xFF;
  CHECK(life.finish(true, 1) == CardStep::kDone);
}

TEST_CASE("card: one that stays busy is given five seconds, before a block and behind it") {
  Life life;
  REQUIRE(life.start());
  for (uint8_t reads = 0; reads < 2; ++reads) {
    life.model.leave_busy(0xFFFF);
    CHECK(life.finish(reads != 0, 0) == CardStep::kFailed);
    CHECK(life.card.status() == CardStatus::kTimeout);
    CHECK(life.took(5000000, 300));
    life.model.leave_busy(0);
    CHECK(life.finish(reads != 0, 0) == CardStep::kDone);
  }
  life.model.busy_bytes = 0xFFFF;
  CHECK(life.finish(false, 0) == CardStep::kFailed);
  CHECK(life.card.status() == CardStatus::kTimeout);
  CHECK(life.took(5000000, 4000));
}

TEST_CASE("card: a block refused and a card that is gone are told apart") {
  Life life;
  REQUIRE(life.start());
  for (uint8_t reads = 0; reads < 2; ++reads) {
    life.model.refuses = reads != 0 ? 17 : 24;
    CHECK(life.finish(reads != 0, 0) == CardStep::kFailed);
    CHECK(life.card.status() == CardStatus::kCommand);
    life.model.refuses = 0xFF;
    CHECK(life.finish(reads != 0, 0) == CardStep::kDone);
    life.model.present = false;
    CHECK(life.finish(reads != 0, 0) == CardStep::kFailed);
    CHECK(life.card.status() == CardStatus::kNoResponse);
    life.model.present = true;
  }
}

TEST_CASE("card: a call out of turn fails and moves no byte") {
  Life life;
  const uint32_t before = life.model.bytes;
  life.card.begin_block_at(1);  // not started
  CHECK(life.card.read(block) == CardStep::kFailed);
  CHECK(life.card.write(block) == CardStep::kFailed);
  CHECK(!life.card.poll());
  CHECK(!life.card.ready());
  CHECK(!life.card.initialised());
  CHECK(life.model.bytes == before);
  REQUIRE(life.start());
  const uint32_t behind = life.model.bytes;
  CHECK(life.card.read(block) == CardStep::kFailed);
  CHECK(life.card.write(block) == CardStep::kFailed);
  CHECK(!life.card.poll());
  CHECK(!life.card.ready());
  CHECK(life.model.bytes == behind);
}

TEST_CASE("card: the capacity of version 2, each bit of C_SIZE") {
  for (uint8_t bit = 0; bit < 22; ++bit) {
    uint8_t csd[16];
    memset(csd, 0xFF, sizeof(csd));  // what is around it says nothing
    put_bits(csd, 126, 2, 1);
    const uint32_t size = 1UL << bit;
    put_bits(csd, 48, 22, size);
    CHECK(sectors_of(csd) == (size + 1) * 1024);
  }
}

TEST_CASE("card: the capacity of version 1, each bit of C_SIZE, multiplier and block length") {
  for (uint8_t bit = 0; bit < 12; ++bit) {
    for (uint8_t length = 8; length <= 12; ++length) {
      uint8_t csd[16];
      memset(csd, bit % 2 == 0 ? 0xFF : 0, sizeof(csd));
      const uint8_t multiplier = bit % 8;
      const uint32_t size = 1UL << bit;
      put_bits(csd, 126, 2, 0);
      put_bits(csd, 80, 4, length);
      put_bits(csd, 62, 12, size);
      put_bits(csd, 47, 3, multiplier);
      const bool good = length >= 9 && length <= 11;
      // Section 5.3.2: (C_SIZE + 1) * 2^(C_SIZE_MULT + 2) blocks of 2^READ_BL_LEN bytes.
      const uint32_t bytes_512 = (size + 1) << (multiplier + 2);
      CHECK(sectors_of(csd) == (good ? bytes_512 << (length - 9) : 0));
    }
  }
  for (uint8_t version = 2; version < 4; ++version) {
    uint8_t csd[16] = {};
    put_bits(csd, 126, 2, version);
    CHECK(sectors_of(csd) == 0U);
  }
}
