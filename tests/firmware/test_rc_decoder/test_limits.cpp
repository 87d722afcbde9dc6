// The decoder at its limits, to the tick: pulses placed one by one.
#include "check.h"
#include "core/rc_decoder.h"

namespace {

using core::RcDecoder;

constexpr uint32_t kMs = 2000;  // ticks
constexpr uint16_t kWidth = 3000;
constexpr uint32_t kStart = 1000000;

// One line with pulses at chosen times; all others are low.
struct Line {
  RcDecoder decoder;
  uint8_t bit = 1;
  uint32_t rise_ticks = kStart;

  Line() { decoder.edge(kStart, 0, false); }
  // Rises so long behind the rise of the pulse before, and is looked at once its low time is over.
  bool pulse(uint32_t period_ticks) {
    const uint16_t glitches = decoder.glitches();
    rise_ticks += period_ticks;
    decoder.edge(rise_ticks, bit, false);
    decoder.edge(rise_ticks + kWidth, 0, false);
    decoder.poll(rise_ticks + kWidth + RcDecoder::kLowAfterTicks);
    return decoder.glitches() == glitches;
  }
  void frames(uint8_t count, uint32_t period_ticks = 20 * kMs) {
    while (count-- != 0) pulse(period_ticks);
  }
};

}  // namespace

TEST_CASE("the first look tells the levels alone: a line that is high then ends no pulse") {
  RcDecoder decoder;
  decoder.edge(kStart, 0b10001, false);
  decoder.edge(kStart + kWidth, 0, false);
  decoder.poll(kStart + kWidth + 5 * kMs);
  CHECK_EQ(decoder.valid(), 0);
}

TEST_CASE("each line counts as having fallen at the first look") {
  for (uint8_t input = 0; input < core::kRcInputs; input = static_cast<uint8_t>(input + 4)) {
    Line line;
    line.bit = static_cast<uint8_t>(1U << input);
    CHECK(!line.pulse(RcDecoder::kLowBeforeTicks - 1));
    CHECK_EQ(line.decoder.valid(), 0);
    Line other;
    other.bit = line.bit;
    CHECK(other.pulse(RcDecoder::kLowBeforeTicks));
    CHECK_EQ(other.decoder.valid(), other.bit);
  }
}

TEST_CASE("every accepted pulse is one change") {
  Line line;
  line.frames(1);
  const uint8_t changes = line.decoder.changes();
  line.frames(3);
  CHECK_EQ(line.decoder.changes(), changes + 3);
}

TEST_CASE("a pulse that is high again too soon is gone, and counted at once") {
  Line line;
  line.frames(5);
  const uint32_t rise_ticks = line.rise_ticks + 20 * kMs;
  const uint16_t glitches = line.decoder.glitches();
  line.decoder.edge(rise_ticks, 1, false);
  line.decoder.edge(rise_ticks + 2000, 0, false);
  line.decoder.edge(rise_ticks + 2000 + RcDecoder::kLowAfterTicks - 1, 1, false);
  CHECK_EQ(line.decoder.glitches(), glitches + 1);
  CHECK(!line.decoder.waiting());
  CHECK_EQ(line.decoder.width_ticks(0), kWidth);
}

TEST_CASE("a pulse nobody looked at is accepted at the next rise, as its own line's") {
  for (uint8_t input = 0; input < core::kRcInputs; ++input) {
    RcDecoder decoder;
    const uint8_t bit = static_cast<uint8_t>(1U << input);
    decoder.edge(kStart, 0, false);
    decoder.edge(kStart + 20 * kMs, bit, false);
    decoder.edge(kStart + 20 * kMs + kWidth, 0, false);
    decoder.edge(kStart + 40 * kMs, bit, false);
    CHECK_EQ(decoder.valid(), bit);
    CHECK_EQ(decoder.width_ticks(input), kWidth);
    CHECK_EQ(decoder.glitches(), 0);
  }
}

TEST_CASE("a candidate that was refused is not accepted by the next rise") {
  Line line;
  line.frames(5);
  // Early, hence refused; the line stays low for a frame behind it.
  CHECK(!line.pulse(5 * kMs));
  const uint8_t changes = line.decoder.changes();
  line.decoder.edge(line.rise_ticks + 6 * kMs, 1, false);
  CHECK_EQ(line.decoder.changes(), changes);
}

TEST_CASE("with a known frame the next pulse may come 4.5 ms early, to the tick") {
  Line line;
  line.frames(5);
  CHECK(line.pulse(31000));
  Line other;
  other.frames(5);
  CHECK(!other.pulse(30999));
}

TEST_CASE("whatever the frame, no pulse comes within 9 ms of the last") {
  const uint32_t periods[] = {9 * kMs, 10 * kMs, 13 * kMs};
  for (const uint32_t period : periods) {
    Line line;
    line.frames(5, period);
    CHECK_EQ(line.decoder.frame_us(), period / 2);
    CHECK(!line.pulse(9 * kMs - 1));
    Line other;
    other.frames(5, period);
    CHECK(other.pulse(9 * kMs));
  }
}

TEST_CASE("frame times from 9 to 25 ms are measured, to the tick") {
  const uint32_t periods[] = {9 * kMs, 25 * kMs};
  for (const uint32_t period : periods) {
    Line line;
    line.frames(2, period);
    CHECK_EQ(line.decoder.frame_us(), period / 2);
  }
  Line line;
  line.frames(4, 25 * kMs + 2);
  CHECK_EQ(line.decoder.frame_us(), 0);
}

TEST_CASE("the frame time follows by an eighth of each change") {
  Line line;
  line.frames(5);
  CHECK_EQ(line.decoder.frame_us(), 20000);
  line.pulse(41600);
  CHECK_EQ(line.decoder.frame_us(), 20100);
  line.pulse(41600);
  CHECK_EQ(line.decoder.frame_us(), 20187);
  line.pulse(38374);
  CHECK_EQ(line.decoder.frame_us(), 20062);
}

TEST_CASE("the frame is measured by the first line that is valid, whichever that is") {
  for (uint8_t first = 0; first < 3; ++first) {
    RcDecoder decoder;
    decoder.edge(kStart, 0, false);
    const uint8_t one = static_cast<uint8_t>(1U << first);
    const uint8_t two = static_cast<uint8_t>(one << 1);
    uint32_t at = kStart;
    for (uint8_t frame = 0; frame < 6; ++frame) {
      at += 20 * kMs;
      decoder.edge(at, one, false);
      decoder.edge(at + kWidth, 0, false);
      // The second line comes later and later.
      const uint32_t behind = at + 3 * kMs + frame * 400U;
      decoder.edge(behind, two, false);
      decoder.edge(behind + kWidth, 0, false);
      decoder.poll(behind + kWidth + RcDecoder::kLowAfterTicks);
    }
    CHECK_EQ(decoder.valid(), one | two);
    CHECK_EQ(decoder.frame_us(), 20000);
  }
}

TEST_CASE("behind a storm the first pulse may come at any time, and measures no frame") {
  Line line;
  line.frames(5);
  line.decoder.storm();
  CHECK_EQ(line.decoder.frame_us(), 0);
  const uint32_t accepted_ticks = line.rise_ticks;
  line.decoder.edge(accepted_ticks + 3 * kMs, 0, false);
  CHECK(line.pulse(8 * kMs));
  CHECK_EQ(line.decoder.valid(), 1);
  line.decoder.storm();
  line.decoder.edge(line.rise_ticks + 3 * kMs, 0, false);
  CHECK(line.pulse(12 * kMs));
  CHECK_EQ(line.decoder.frame_us(), 0);
}

TEST_CASE("thirteen early pulses without a frame between them measure the receiver anew") {
  Line line;
  line.frames(5);
  // Frames of 26 ms are accepted but measure nothing; early pulses between them add up.
  uint8_t early = 0;
  while (early < 12) {
    CHECK(!line.pulse(7 * kMs));
    CHECK(!line.pulse(7 * kMs));
    early = static_cast<uint8_t>(early + 2);
    CHECK(line.pulse(12 * kMs));
  }
  Line other = line;
  CHECK(!line.pulse(10 * kMs));  // the thirteenth
  CHECK(line.pulse(2 * kMs + 4000));
  // With the frame still known a pulse at 14 ms would have been early.
  CHECK(!other.pulse(14 * kMs));
}

TEST_CASE("a line stays steady however long it is") {
  Line line;
  for (uint16_t i = 0; i < 600; ++i) {
    line.pulse(20 * kMs);
    if (i >= 2) CHECK_EQ(line.decoder.steady(), 1);
  }
}

TEST_CASE("fresh for 45 ms, steady for 49, valid for 60, looked at each 2 ms") {
  Line line;
  line.frames(5);
  const uint32_t accepted_ticks = line.rise_ticks;
  // Looks count from the last one: begin with one at a known time.
  line.decoder.poll(accepted_ticks + 10 * kMs);
  line.decoder.poll(accepted_ticks + RcDecoder::kFreshTicks);
  CHECK_EQ(line.decoder.fresh(), 1);
  line.decoder.poll(accepted_ticks + RcDecoder::kFreshTicks + RcDecoder::kAgeTicks - 1);
  CHECK_EQ(line.decoder.fresh(), 1);
  const uint8_t changes = line.decoder.changes();
  line.decoder.poll(accepted_ticks + RcDecoder::kFreshTicks + RcDecoder::kAgeTicks);
  CHECK_EQ(line.decoder.fresh(), 0);
  CHECK_EQ(line.decoder.changes(), changes + 1);
  line.decoder.poll(accepted_ticks + RcDecoder::kUnsteadyTicks);
  CHECK_EQ(line.decoder.steady(), 1);
  line.decoder.poll(accepted_ticks + RcDecoder::kUnsteadyTicks + RcDecoder::kAgeTicks);
  CHECK_EQ(line.decoder.steady(), 0);
  CHECK_EQ(line.decoder.changes(), changes + 2);
  line.decoder.poll(accepted_ticks + RcDecoder::kLostTicks);
  CHECK_EQ(line.decoder.valid(), 1);
  CHECK_EQ(line.decoder.changes(), changes + 2);
  line.decoder.poll(accepted_ticks + RcDecoder::kLostTicks + RcDecoder::kAgeTicks);
  CHECK_EQ(line.decoder.valid(), 0);
  CHECK_EQ(line.decoder.changes(), changes + 3);
}

TEST_CASE("a pulse behind two missed frames of 17 ms makes the channel steady again") {
  Line line;
  line.frames(5);
  line.decoder.poll(line.rise_ticks + RcDecoder::kUnsteadyTicks + RcDecoder::kAgeTicks);
  CHECK_EQ(line.decoder.steady(), 0);
  CHECK_EQ(line.decoder.valid(), 1);
  line.pulse(54 * kMs);
  CHECK_EQ(line.decoder.steady(), 1);
}

TEST_CASE("a pulse waits for its low time, to the tick, and only while its line is low") {
  Line line;
  line.frames(5);
  const uint32_t rise_ticks = line.rise_ticks + 20 * kMs;
  line.decoder.edge(rise_ticks, 1, false);
  line.decoder.edge(rise_ticks + 2000, 0, false);
  CHECK(line.decoder.waiting());
  line.decoder.poll(rise_ticks + 2000 + RcDecoder::kLowAfterTicks - 1);
  CHECK_EQ(line.decoder.width_ticks(0), kWidth);
  CHECK(line.decoder.waiting());
  line.decoder.poll(rise_ticks + 2000 + RcDecoder::kLowAfterTicks);
  CHECK_EQ(line.decoder.width_ticks(0), 2000);
  CHECK(!line.decoder.waiting());
}

TEST_CASE("edges that were lost forget what was half seen and keep what was accepted") {
  Line line;
  line.frames(5);
  const uint32_t rise_ticks = line.rise_ticks + 20 * kMs;
  line.decoder.edge(rise_ticks, 1, false);
  line.decoder.edge(rise_ticks + 2000, 0, false);
  line.decoder.gap();
  CHECK(!line.decoder.waiting());
  line.decoder.poll(rise_ticks + 3 * kMs);
  CHECK_EQ(line.decoder.width_ticks(0), kWidth);
  // A rise before the gap does not make a pulse with a fall behind it.
  line.decoder.edge(rise_ticks + 6 * kMs, 0, false);
  line.decoder.edge(rise_ticks + 10 * kMs, 1, false);
  line.decoder.gap();
  line.decoder.edge(rise_ticks + 10 * kMs + 1000, 1, false);
  line.decoder.edge(rise_ticks + 10 * kMs + 2000, 0, false);
  line.decoder.poll(rise_ticks + 14 * kMs);
  CHECK_EQ(line.decoder.width_ticks(0), kWidth);
  CHECK_EQ(line.decoder.valid(), 1);
}

TEST_CASE("a lost channel leaves the frame time to the others; the last one takes it along") {
  RcDecoder decoder;
  decoder.edge(kStart, 0, false);
  uint32_t at = kStart;
  for (uint8_t frame = 0; frame < 10; ++frame) {
    at += 20 * kMs;
    // The second channel is gone behind the fifth frame.
    const uint8_t sent = frame < 5 ? 3 : 1;
    decoder.edge(at, sent, false);
    decoder.edge(at + kWidth, 0, false);
    decoder.poll(at + kWidth + RcDecoder::kLowAfterTicks);
    CHECK_EQ(decoder.frame_us(), frame == 0 ? 0 : 20000);
  }
  CHECK_EQ(decoder.valid(), 1);
  CHECK_EQ(decoder.frame_us(), 20000);
  decoder.poll(at + 63 * kMs);
  CHECK_EQ(decoder.valid(), 0);
  CHECK_EQ(decoder.frame_us(), 0);
}

namespace {

// What is said of pulses of that width with that low time between them.
uint16_t refused_hz(uint16_t pulses, uint32_t width_ticks, uint32_t low_ticks, bool late = false) {
  RcDecoder decoder;
  decoder.edge(kStart, 0, false);
  uint32_t at = kStart + 20 * kMs;
  for (; pulses != 0; --pulses) {
    decoder.edge(at, 1, late);
    decoder.edge(at + width_ticks, 0, false);
    at += width_ticks + low_ticks;
  }
  return decoder.refused_hz();
}

}  // namespace

TEST_CASE("a fast receiver is told from noise by the time between its pulses, to the tick") {
  CHECK_EQ(refused_hz(250, 2000, 2000), 0);  // 249 came too fast
  CHECK_EQ(refused_hz(251, 2000, 2000), 500);
  CHECK_EQ(refused_hz(300, 2000, 2000, true), 0);  // no stamp to be trusted
  CHECK_EQ(refused_hz(300, 2000, RcDecoder::kLowBeforeTicks - 1), 333);
  CHECK_EQ(refused_hz(300, 2000, RcDecoder::kLowBeforeTicks + 1000), 0);  // long enough a low
  CHECK_EQ(refused_hz(300, 600, 1000), 1250);
  CHECK_EQ(refused_hz(300, 600, 999), 0);
  CHECK_EQ(refused_hz(300, 4401, 3999), 238);
  CHECK_EQ(refused_hz(300, 4402, 3999), 0);
}

TEST_CASE("a pulse that is used begins the count of fast ones anew") {
  Line line;
  line.frames(3);
  for (uint8_t i = 0; i < RcDecoder::kRefusedPulses - 1; ++i) {
    line.pulse(kWidth + 2000);
  }
  CHECK_EQ(line.decoder.refused_hz(), 0);
  line.pulse(kWidth + 2000);
  CHECK_EQ(line.decoder.refused_hz(), 400);
}

TEST_CASE("a pulse refused for a dropout does not come back at the next rise") {
  RcDecoder decoder;
  decoder.edge(kStart, 0, false);
  const uint32_t at = kStart + 20 * kMs;
  decoder.edge(at, 1, false);
  decoder.edge(at + 2000, 0, false);
  decoder.edge(at + 2200, 1, false);  // 100 us of dropout
  decoder.edge(at + 3000, 0, false);
  decoder.edge(at + 40000, 1, false);
  CHECK_EQ(decoder.valid(), 0);
  CHECK_EQ(decoder.width_ticks(0), 0);
  CHECK_EQ(decoder.glitches(), 2);
}

TEST_CASE("one look finds all that are lost") {
  RcDecoder decoder;
  decoder.edge(kStart, 0, false);
  decoder.edge(kStart + 10 * kMs, 0b1'1111, false);
  decoder.edge(kStart + 10 * kMs + kWidth, 0, false);
  decoder.poll(kStart + 13 * kMs);
  CHECK_EQ(decoder.valid(), 0b1'1111);
  decoder.poll(kStart + 10 * kMs + RcDecoder::kFreshTicks + 1);
  CHECK_EQ(decoder.fresh(), 0);
  CHECK_EQ(decoder.valid(), 0b1'1111);
  decoder.poll(kStart + 10 * kMs + RcDecoder::kLostTicks + 1);
  CHECK_EQ(decoder.valid(), 0);
}

TEST_CASE("the count of refused pulses stays at its end") {
  Line line;
  for (uint32_t i = 0; i < 65600; ++i) {
    line.pulse(kWidth + 1000);
  }
  CHECK_EQ(line.decoder.glitches(), 0xFFFF);
}

TEST_CASE("the first edge behind a gap begins no pulse: how long the line was low is not known") {
  Line line;
  line.frames(5);
  const uint8_t changes = line.decoder.changes();
  line.decoder.gap();
  line.pulse(20 * kMs);
  CHECK_EQ(line.decoder.changes(), changes);
  line.pulse(20 * kMs);
  CHECK(line.decoder.changes() != changes);
}

TEST_CASE("a pulse is fresh for 45 ms to the tick, wherever the clock stands") {
  for (uint32_t phase = 0; phase < 3000; ++phase) {
    RcDecoder decoder;
    const uint32_t start_ticks = phase * 1048573U;  // all of the 32 bits, and around their end
    decoder.edge(start_ticks, 0, false);
    const uint32_t rise_ticks = start_ticks + 20 * kMs;
    decoder.edge(rise_ticks, 1, false);
    decoder.edge(rise_ticks + kWidth, 0, false);
    decoder.poll(rise_ticks + kWidth + RcDecoder::kLowAfterTicks);
    RcDecoder early = decoder;
    early.poll(rise_ticks + RcDecoder::kFreshTicks - 1);
    REQUIRE(early.fresh() == 1);
    RcDecoder last = decoder;
    last.poll(rise_ticks + RcDecoder::kFreshTicks);
    REQUIRE(last.fresh() == 1);
    decoder.poll(rise_ticks + RcDecoder::kFreshTicks + 1);
    REQUIRE(decoder.fresh() == 0);
    decoder.poll(rise_ticks + RcDecoder::kLostTicks + 1);
    REQUIRE(decoder.valid() == 0);
  }
}

TEST_CASE("one late look takes all that is over: fresh and steady at once") {
  Line line;
  line.frames(5);
  const uint8_t changes = line.decoder.changes();
  line.decoder.poll(line.rise_ticks + RcDecoder::kUnsteadyTicks + 1);
  CHECK_EQ(line.decoder.steady(), 0);
  CHECK_EQ(line.decoder.fresh(), 0);
  CHECK_EQ(line.decoder.valid(), 1);
  CHECK_EQ(line.decoder.changes(), changes + 2);
}

TEST_CASE("pulses too short to be used are no fast receiver where the low before each is 2 ms") {
  const uint32_t lows_ticks[] = {RcDecoder::kLowBeforeTicks, RcDecoder::kLowBeforeTicks + 1000};
  for (const uint32_t low_ticks : lows_ticks) {
    CHECK_EQ(refused_hz(600, 1000, low_ticks), 0);
  }
}

TEST_CASE("lines beyond the fifth are nobody's") {
  Line line;
  line.frames(5);
  const uint8_t changes = line.decoder.changes();
  const uint16_t glitches = line.decoder.glitches();
  for (uint8_t i = 0; i < 6; ++i) {
    const uint32_t at = line.rise_ticks + 4 * kMs + i * 3 * kMs;
    line.decoder.edge(at, 0b1110'0000, false);
    line.decoder.edge(at + kWidth, 0, false);
    line.decoder.poll(at + kWidth + RcDecoder::kLowAfterTicks);
  }
  CHECK_EQ(line.decoder.changes(), changes);
  CHECK_EQ(line.decoder.glitches(), glitches);
  CHECK_EQ(line.decoder.valid(), 1);
  CHECK(!line.decoder.waiting());
}
