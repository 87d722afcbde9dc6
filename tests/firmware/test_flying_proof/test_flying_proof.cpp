// What proves that the aircraft flies, at each of its limits, and what proves nothing.
#include "check.h"
#include "core/flying_proof.h"
#include "random_numbers.h"

namespace {

using core::FlyingProof;
using core::InputReadings;

constexpr uint16_t kZero = 2060;
constexpr uint16_t kLeast = kZero + FlyingProof::kPitotAboveZero;

struct Bench {
  FlyingProof proof;
  InputReadings in = {};
  uint32_t now_us;
  uint16_t gps_old_ms = 0;
  uint16_t gps_every_ms = 200;

  explicit Bench(uint8_t airspeed_input = 4,
                 uint16_t dp_min = 0,
                 uint32_t at_us = 0xFFFFFFFFU - 1500000U)
      : now_us(at_us) {
    in.valid = frames::kValidDpA | frames::kValidDpB;
    in.pitot[0] = in.pitot[1] = kZero;
    proof.tare(airspeed_input, dp_min, in, now_us);
  }
  // Looks each 10 ms at scans 4 ms old; an epoch of the GPS each 0.2 s. True: it held at the end.
  bool run(uint16_t ms) {
    in.scan_age_us = 4000;
    for (; ms >= 10; ms = static_cast<uint16_t>(ms - 10)) {
      now_us += 10000;
      gps_old_ms = static_cast<uint16_t>(gps_old_ms + 10);
      if (gps_old_ms >= gps_every_ms) gps_old_ms = 0;
      in.gps_age_us = uint32_t{gps_old_ms} * 1000U;
      proof.look(in, now_us);
    }
    return proof.holds();
  }
};

bool flies(uint16_t pitot, uint16_t ground_speed_cmps, uint8_t airspeed_input = 4) {
  Bench bench(airspeed_input);
  bench.in.pitot[airspeed_input & 1U] = pitot;
  bench.in.ground_speed_cmps = ground_speed_cmps;
  return bench.run(6000);
}

}  // namespace

TEST_CASE("one witness is enough, at its limit and one step before it") {
  CHECK(!flies(kZero, 0));
  CHECK(flies(kLeast, 0));
  CHECK(!flies(kLeast - 1, 0));
  CHECK(flies(kZero, FlyingProof::kMovingCmps + 1));
  CHECK(!flies(kZero, FlyingProof::kMovingCmps));
  CHECK(flies(kLeast, 0, 5));
  CHECK(!flies(kLeast - 1, 0, 5));
  // Wind of 12 m/s in the densest air is 94 Pa.
  CHECK(!flies(kZero + 77, 0));
}

TEST_CASE("the pitot that the card does not watch proves nothing") {
  const uint8_t inputs[] = {4, 5, 255};
  for (const uint8_t watched : inputs) {
    Bench bench(watched);
    bench.in.pitot[0] = watched == 4 ? kZero : 4000;
    bench.in.pitot[1] = watched == 5 ? kZero : 4000;
    CHECK(!bench.run(6000));
    bench.in.ground_speed_cmps = 1500;
    CHECK(bench.run(6000));
  }
}

TEST_CASE("the card's least airspeed counts where it is the larger, however large") {
  const uint16_t leasts[] = {kLeast + 1, 3000, 4092, 0x7FFF, 0x8000, 0xFFFF};
  for (const uint16_t least : leasts) {
    Bench bench(5, least);
    bench.in.pitot[1] = static_cast<uint16_t>(least - 1U > 4092U ? 4092U : least - 1U);
    CHECK(!bench.run(6000));
    if (least > 4092) continue;
    bench.in.pitot[1] = least;
    CHECK(bench.run(6000));
  }
}

TEST_CASE("a zero is within the sensor's band, of a pitot that is neither open nor shorted") {
  const uint16_t zeros[] = {2048 - 206, 2048 - 205, 2048 + 205, 2048 + 206};
  for (uint8_t i = 0; i < 4; ++i) {
    Bench bench;
    bench.in.pitot[0] = zeros[i];
    bench.proof.tare(4, 0, bench.in, bench.now_us);
    bench.in.pitot[0] = static_cast<uint16_t>(zeros[i] + FlyingProof::kPitotAboveZero);
    CHECK_EQ(bench.run(6000), i == 1 || i == 2);
  }
  Bench open;
  open.in.valid = frames::kValidDpB;
  open.proof.tare(4, 0, open.in, open.now_us);
  open.in.valid = frames::kValidDpA | frames::kValidDpB;
  open.in.pitot[0] = 3000;
  CHECK(!open.run(6000));
}

TEST_CASE("the zero is that of the pitot which the card watches") {
  for (uint8_t b = 0; b < 2; ++b) {
    Bench bench;
    bench.in.pitot[b] = kZero;
    bench.in.pitot[1 - b] = kZero - 100;
    bench.proof.tare(static_cast<uint8_t>(4 + b), 0, bench.in, bench.now_us);
    bench.in.pitot[b] = kLeast - 1;
    CHECK(!bench.run(6000));
    bench.in.pitot[b] = kLeast;
    CHECK(bench.run(6000));
  }
}

TEST_CASE("a reading that is open or old proves nothing") {
  Bench bench;
  bench.in.pitot[0] = 3000;
  CHECK(bench.run(6000));
  bench.in.valid = frames::kValidDpB;
  bench.proof.look(bench.in, bench.now_us);
  CHECK(!bench.proof.holds());
  Bench old;
  old.in.pitot[0] = 3000;
  CHECK(old.run(6000));
  old.in.scan_age_us = core::kInputScanAgeUs;
  old.proof.look(old.in, old.now_us);
  CHECK(old.proof.holds());
  old.in.scan_age_us = core::kInputScanAgeUs + 1;
  old.proof.look(old.in, old.now_us);
  CHECK(!old.proof.holds());
}

TEST_CASE("3 s without a gap, wherever in its step it begins, and each witness for itself") {
  for (uint32_t begin_us = 0; begin_us < 40000; begin_us += 1000) {
    Bench bench(4, 0, begin_us - 20000U);
    CHECK(!bench.run(500));
    bench.in.pitot[0] = kLeast;
    CHECK(!bench.run(3000));
    CHECK(bench.run(60));
    bench.in.pitot[0] = kLeast - 1;
    CHECK(!bench.run(10));
    bench.in.pitot[0] = kLeast;
    CHECK(!bench.run(3000));
    CHECK(bench.run(60));
  }
  // Two that take turns are none.
  Bench turns;
  for (uint8_t i = 0; i < 8; ++i) {
    turns.in.pitot[0] = i % 2 == 0 ? 3000 : kZero;
    turns.in.ground_speed_cmps = i % 2 == 0 ? 0 : 1500;
    CHECK(!turns.run(2000));
  }
}

TEST_CASE("a GPS is as fast as its last epoch, and only so long as that is heard") {
  Bench bench;
  // 2 s of wandering, then silence: 3 s from its first epoch, but not to its last.
  bench.in.ground_speed_cmps = 800;
  CHECK(!bench.run(2000));
  bench.gps_every_ms = 60000U;
  CHECK(!bench.run(3000));
  bench.gps_every_ms = 200;
  CHECK(!bench.run(2900));
  CHECK(bench.run(500));
  // Heard 1 s ago it still counts, behind that not.
  bench.gps_every_ms = 60000U;
  bench.gps_old_ms = 0;
  CHECK(bench.run(1000));
  CHECK(!bench.run(10));
}

TEST_CASE("it holds as long as it is asked, over every wrap of the clock") {
  Bench bench(4, 0, 0xFFFFFFFFU - 5000000U);
  bench.in.pitot[0] = 3000;
  CHECK(bench.run(3200));
  for (uint8_t i = 0; i < 60; ++i) CHECK(bench.run(200));
}

TEST_CASE("looks that stay away are a gap, and a look a little ahead of its sample is none") {
  for (uint16_t gap_ms = 600; gap_ms < 1300; gap_ms = static_cast<uint16_t>(gap_ms + 50)) {
    Bench bench;
    bench.in.pitot[0] = 3000;
    CHECK(bench.run(6000));
    bench.now_us += uint32_t{gap_ms} * 1000U;
    bench.proof.look(bench.in, bench.now_us);
    CHECK(!bench.proof.holds());
  }
  Bench ahead;
  CHECK(!ahead.run(1000));
  ahead.in.pitot[0] = 3000;
  // The sample was taken before the last no.
  ahead.in.scan_age_us = 20000;
  ahead.proof.look(ahead.in, ahead.now_us);
  CHECK(!ahead.proof.holds());
  CHECK(!ahead.run(2900));
  CHECK(ahead.run(200));
}

TEST_CASE("without the sign nothing is proven, and a new sign begins anew") {
  FlyingProof never;
  InputReadings in = {};
  in.valid = frames::kValidDpA | frames::kValidDpB;
  in.pitot[0] = in.pitot[1] = 4092;
  in.gps_age_us = UINT32_MAX;
  for (uint32_t now_us = 0; now_us < 9000000U; now_us += 10000) {
    never.look(in, now_us);
    CHECK(!never.holds());
  }
  Bench bench;
  bench.in.ground_speed_cmps = 1500;
  CHECK(bench.run(4000));
  bench.proof.tare(4, 0, bench.in, bench.now_us);
  CHECK(!bench.proof.holds());
  CHECK(!bench.run(2900));
}

TEST_CASE("random witnesses: it holds only where one was right for 3 s, and always 0.1 s later") {
  Random random(461);
  Bench bench;
  uint16_t pitot_ms = 0;
  uint16_t gps_ms = 0;
  for (uint16_t n = 0; n < 4000; ++n) {
    const bool pitot = random.below(100) != 0 && (n & 1024) == 0;
    const bool gps = random.below(70) != 0;
    bench.in.pitot[0] = pitot ? 3000 : kZero;
    bench.in.ground_speed_cmps = gps ? 1500 : 100;
    bench.gps_every_ms = 10;
    const bool holds = bench.run(20);
    pitot_ms = pitot ? static_cast<uint16_t>(pitot_ms + 20) : uint16_t{0};
    gps_ms = gps ? static_cast<uint16_t>(gps_ms + 20) : uint16_t{0};
    const uint16_t longest_ms = pitot_ms > gps_ms ? pitot_ms : gps_ms;
    if (longest_ms <= 3000) CHECK(!holds);
    if (longest_ms >= 3100) CHECK(holds);
  }
}
