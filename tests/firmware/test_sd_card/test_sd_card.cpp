// The card driver on a model of a card, and every way the model can go wrong.
#include "check.h"
#include "drivers/sd_card.h"
#include "model_card.h"

namespace {

using drivers::CardStatus;
using drivers::CardStep;
using drivers::CardWrite;

struct Bench {
  ModelCard model;
  drivers::SdCard<ModelCard> card{model};
  uint32_t longest_poll_us = 0;
  uint32_t longest_step_us = 0;
  CardStep last = CardStep::kAgain;

  bool start() {
    card.start();
    bool again = true;
    while (again) {
      const uint32_t from_us = model.now_us();
      again = card.poll();
      const uint32_t took_us = model.now_us() - from_us;
      longest_poll_us = took_us > longest_poll_us ? took_us : longest_poll_us;
      model.advance_us(200);
    }
    return card.initialised();
  }
  // A single block, step by step. False: it failed.
  bool finish(CardStep step, uint32_t from_us) {
    const uint32_t took_us = model.now_us() - from_us;
    longest_step_us = took_us > longest_step_us ? took_us : longest_step_us;
    last = step;
    model.advance_us(200);
    return step == CardStep::kAgain;
  }
  bool read(uint32_t sector, uint8_t* to) {
    card.begin_block_at(sector);
    uint32_t from_us = model.now_us();
    while (finish(card.read(to), from_us)) {
      from_us = model.now_us();
    }
    return last == CardStep::kDone;
  }
  bool write(uint32_t sector, const uint8_t* from) {
    card.begin_block_at(sector);
    uint32_t from_us = model.now_us();
    while (finish(card.write(from), from_us)) {
      from_us = model.now_us();
    }
    return last == CardStep::kDone;
  }
  // Bytes on the bus until a block may begin; 0 if it never may.
  uint16_t until_ready() {
    for (uint16_t turns = 1; turns < 500; ++turns) {
      if (card.ready()) {
        return turns;
      }
    }
    return 0;
  }
  CardWrite send(uint8_t content) {
    uint8_t piece[64];
    memset(piece, content, sizeof(piece));
    card.begin_block();
    core::Crc32 handed;
    core::Crc32 alone;
    for (uint8_t i = 0; i < 8; ++i) {
      handed.set_state(card.put(piece, sizeof(piece), handed.state()));
      alone.add(piece, sizeof(piece));
    }
    CHECK_EQ(handed.value(), alone.value());
    return card.end_block();
  }
  bool holds(uint8_t sector, uint8_t content) const {
    for (const uint8_t byte : model.store[sector]) {
      if (byte != content) {
        return false;
      }
    }
    return true;
  }
};

uint8_t sector_buffer[512];

}  // namespace

TEST_CASE("an SDHC card starts: slow clocks first, CRC on, then fast") {
  Bench bench;
  REQUIRE(bench.start());
  CHECK(bench.model.free_clocks >= 10);
  CHECK(bench.model.is_fast);
  CHECK(bench.model.crc_on);
  CHECK_EQ(bench.model.bad_commands, 0);
  CHECK(bench.card.high_capacity());
  CHECK(bench.card.sectors() == 15160UL * 1024);
  CHECK_EQ(bench.card.cid()[0], 0xC0);
  CHECK_EQ(bench.card.cid()[15], 0xCF);
  CHECK(bench.longest_poll_us < 1100);
}

TEST_CASE("an SDSC card of version 1 starts and is addressed in bytes") {
  Bench bench;
  bench.model.version_2 = false;
  bench.model.high_capacity = false;
  REQUIRE(bench.start());
  CHECK(!bench.card.high_capacity());
  CHECK(bench.card.sectors() == 3816UL * 512 * 2);
  memset(sector_buffer, 0x5A, 512);
  CHECK(bench.write(2, sector_buffer));
  CHECK(bench.holds(2, 0x5A));
}

TEST_CASE("no card is told within half a second, poll by poll") {
  Bench bench;
  bench.model.present = false;
  CHECK(!bench.start());
  CHECK(bench.card.status() == CardStatus::kNoCard);
  CHECK(bench.longest_poll_us < 1100);
  CHECK(!bench.read(0, sector_buffer));
  CHECK(!bench.card.ready());
}

TEST_CASE("a card that refuses 3.3 V, and one that never becomes ready") {
  Bench refuses;
  refuses.model.wrong_voltage = true;
  CHECK(!refuses.start());
  CHECK(refuses.card.status() == CardStatus::kVoltage);
  Bench never;
  never.model.negotiations = 0xFFFF;
  CHECK(!never.start());
  CHECK(never.card.status() == CardStatus::kInitTimeout);
}

TEST_CASE("a reset in the middle of a block: the card is brought back") {
  Bench bench;
  bench.model.leave_in_block();
  CHECK(bench.start());
}

TEST_CASE("a reset while the card programs: waited for, not taken for an old card") {
  Bench bench;
  bench.model.leave_busy(2000);
  REQUIRE(bench.start());
  CHECK(bench.card.high_capacity());
  CHECK(bench.longest_poll_us < 1100);
  Bench dead;
  dead.model.leave_busy(0xFFFF);
  CHECK(!dead.start());
  CHECK(dead.model.now_us() < 2000000UL);
}

TEST_CASE("sectors are written and read back") {
  Bench bench;
  REQUIRE(bench.start());
  for (uint16_t i = 0; i < 512; ++i) {
    sector_buffer[i] = static_cast<uint8_t>(i * 7);
  }
  CHECK(bench.write(1, sector_buffer));
  memset(sector_buffer, 0, 512);
  REQUIRE(bench.read(1, sector_buffer));
  CHECK_EQ(sector_buffer[511], static_cast<uint8_t>(511 * 7));
}

TEST_CASE("a damaged or refused read is noticed") {
  Bench bench;
  REQUIRE(bench.start());
  bench.model.flip_read = true;
  CHECK(!bench.read(0, sector_buffer));
  CHECK(bench.card.status() == CardStatus::kReadCrc);
  bench.model.error_token = true;
  CHECK(!bench.read(0, sector_buffer));
  CHECK(bench.card.status() == CardStatus::kReadToken);
  CHECK(bench.read(0, sector_buffer));
}

TEST_CASE(
    "a block busy for three seconds is waited for, step by step; one that never ends is not") {
  Bench bench;
  REQUIRE(bench.start());
  bench.model.busy_bytes = 14851;  // a look is a byte, 2 us, and a turn of 200 us
  uint32_t from_us = bench.model.now_us();
  CHECK(bench.write(0, sector_buffer));
  CHECK(bench.model.now_us() - from_us > 2900000U);
  bench.model.busy_bytes = 0xFFFF;
  from_us = bench.model.now_us();
  CHECK(!bench.write(0, sector_buffer));
  CHECK(bench.card.status() == CardStatus::kTimeout);
  CHECK(bench.model.now_us() - from_us < 5200000U);
  CHECK(bench.longest_step_us < 1000);
}

TEST_CASE("a step moves no more than half of a block") {
  Bench bench;
  REQUIRE(bench.start());
  const uint32_t before = bench.model.bytes;
  bench.card.begin_block_at(1);
  CardStep step = CardStep::kAgain;
  uint32_t most = 0;
  uint8_t steps = 0;
  while (step == CardStep::kAgain) {
    const uint32_t from = bench.model.bytes;
    step = bench.card.read(sector_buffer);
    const uint32_t moved = bench.model.bytes - from;
    most = moved > most ? moved : most;
    ++steps;
  }
  CHECK(step == CardStep::kDone);
  CHECK(steps >= 3);
  CHECK(most <= 280);
  CHECK(bench.model.bytes - before < 600);
}

TEST_CASE("a stream: one block behind the other, one byte per look at a busy card") {
  Bench bench;
  bench.model.busy_bytes = 40;
  REQUIRE(bench.start());
  bench.card.open_stream(1);
  for (uint8_t i = 0; i < 3; ++i) {
    const uint32_t before = bench.model.bytes;
    const uint16_t turns = bench.until_ready();
    REQUIRE(turns != 0);
    CHECK(bench.model.bytes - before <= turns + 20U);
    CHECK(bench.send(static_cast<uint8_t>(0x11 * (i + 1))) == CardWrite::kAccepted);
    CHECK(!bench.card.ready());
  }
  CHECK(bench.holds(1, 0x11));
  CHECK(bench.holds(2, 0x22));
  CHECK(bench.holds(3, 0x33));
  CHECK_EQ(bench.model.opened, 1);
  bench.until_ready();
  bench.card.close_stream();
  uint16_t turns = 0;
  while (bench.card.closing()) {
    ++turns;
  }
  CHECK(turns > 30);
  CHECK_EQ(bench.model.stopped, 1);
  CHECK(bench.read(3, sector_buffer));
  CHECK_EQ(sector_buffer[0], 0x33);
  CHECK_EQ(bench.model.bad_commands, 0);
}

TEST_CASE("a bit flipped on the wire: rejected, sent again to the same sector, nothing lost") {
  Bench bench;
  REQUIRE(bench.start());
  bench.card.open_stream(0);
  REQUIRE(bench.until_ready() != 0);
  CHECK(bench.send(0x11) == CardWrite::kAccepted);
  REQUIRE(bench.until_ready() != 0);
  bench.model.flip_byte = 300;
  CHECK(bench.send(0x22) == CardWrite::kRejected);
  CHECK(bench.card.status() == CardStatus::kWriteCrc);
  CHECK(bench.card.next_sector() == 1U);
  REQUIRE(bench.until_ready() != 0);
  CHECK(bench.send(0x22) == CardWrite::kAccepted);
  REQUIRE(bench.until_ready() != 0);
  CHECK(bench.send(0x33) == CardWrite::kAccepted);
  CHECK(bench.holds(0, 0x11));
  CHECK(bench.holds(1, 0x22));
  CHECK(bench.holds(2, 0x33));
  CHECK_EQ(bench.model.opened, 2);
  CHECK_EQ(bench.model.stopped, 1);
  CHECK_EQ(bench.model.bad_commands, 0);
}

TEST_CASE("a write error, then a sector further") {
  Bench bench;
  REQUIRE(bench.start());
  bench.card.open_stream(0);
  REQUIRE(bench.until_ready() != 0);
  bench.model.write_error = true;
  CHECK(bench.send(0x11) == CardWrite::kRejected);
  CHECK(bench.card.status() == CardStatus::kWriteError);
  bench.card.open_stream(2);
  REQUIRE(bench.until_ready() != 0);
  CHECK(bench.send(0x44) == CardWrite::kAccepted);
  CHECK(bench.holds(2, 0x44));
  CHECK(bench.holds(0, 0));
}

TEST_CASE("a card pulled out answers nothing, and no call hangs") {
  Bench bench;
  REQUIRE(bench.start());
  bench.card.open_stream(0);
  REQUIRE(bench.until_ready() != 0);
  bench.model.present = false;
  CHECK(bench.send(0x11) == CardWrite::kGone);
  CHECK(bench.card.status() == CardStatus::kNoResponse);
  CHECK_EQ(bench.until_ready(), 0);
  CHECK(bench.card.status() == CardStatus::kCommand);
  bench.card.close_stream();
  while (bench.card.closing()) {
  }
  CHECK(!bench.read(0, sector_buffer));
}

TEST_CASE("the numbers by which the log tells what a card did wrong") {
  const CardStatus by_number[] = {CardStatus::kOk,
                                  CardStatus::kNoCard,
                                  CardStatus::kVoltage,
                                  CardStatus::kInitTimeout,
                                  CardStatus::kCommand,
                                  CardStatus::kReadToken,
                                  CardStatus::kReadCrc,
                                  CardStatus::kWriteCrc,
                                  CardStatus::kWriteError,
                                  CardStatus::kNoResponse,
                                  CardStatus::kTimeout,
                                  CardStatus::kUnsupported};
  for (uint8_t number = 0; number < 12; ++number) {
    CHECK_EQ(static_cast<uint8_t>(by_number[number]), number);
  }
}
