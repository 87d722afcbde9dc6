// Receivers of every kind in, widths out; then each fault of the 2015 decoder (S4 to S9 of its
// analysis) and of the air between.
#include "check.h"
#include "core/rc_decoder.h"
#include "random_numbers.h"

namespace {

constexpr uint32_t kMs = 2000;  // ticks
constexpr uint8_t kAll = 0b1'1111;

// A generated receiver. Edges come from `next`; the clock starts just below its wrap.
struct Receiver {
  core::RcDecoder decoder;
  uint32_t now = 0xFFFFFFFFU - 100 * kMs;
  uint32_t frame_ticks = 20 * kMs;
  bool sequential = true;
  uint16_t widths[core::kRcInputs] = {3000, 2200, 3800, 2000, 4000};
  uint8_t sent = kAll;  // channels that arrive
  uint8_t levels = 0;

  // The first snapshot only tells the levels.
  Receiver() {
    decoder.edge(now, 0, false);
    wait_until(now + 5 * kMs);
  }

  void wait_until(uint32_t t) {
    // Four turns of the main loop between two edges.
    const uint32_t step = (t - now) / 4;
    for (uint8_t i = 0; i < 4; ++i) {
      now += step;
      decoder.poll(now);
    }
    now = t;
  }
  void set(uint8_t mask, bool high, bool late = false) {
    levels = static_cast<uint8_t>(high ? levels | mask : levels & ~mask);
    decoder.edge(now, levels, late);
  }
  void pulse(uint8_t mask, uint16_t width_ticks) {
    set(mask, true);
    wait_until(now + width_ticks);
    set(mask, false);
  }

  void frame() {
    const uint32_t end = now + frame_ticks;
    if (sequential) {
      for (uint8_t i = 0; i < core::kRcInputs; ++i) {
        if ((sent >> i & 1) != 0) {
          pulse(static_cast<uint8_t>(1U << i), widths[i]);
        } else {
          wait_until(now + widths[i]);
        }
      }
    } else {
      simultaneous();
    }
    wait_until(end);
  }
  // All rise at once and fall in the order of their widths.
  void simultaneous() {
    const uint32_t rise = now;
    if (sent != 0) {
      set(sent, true);
    }
    uint8_t left = sent;
    while (left != 0) {
      uint16_t least = 0xFFFF;
      for (uint8_t i = 0; i < core::kRcInputs; ++i) {
        if ((left >> i & 1) != 0 && widths[i] < least) {
          least = widths[i];
        }
      }
      uint8_t mask = 0;
      for (uint8_t i = 0; i < core::kRcInputs; ++i) {
        if ((left >> i & 1) != 0 && widths[i] == least) {
          mask = static_cast<uint8_t>(mask | 1U << i);
        }
      }
      wait_until(rise + least);
      set(mask, false);
      left = static_cast<uint8_t>(left & ~mask);
    }
  }
  void frames(uint8_t count) {
    while (count-- != 0) {
      frame();
    }
  }
  bool all_right() const {
    for (uint8_t i = 0; i < core::kRcInputs; ++i) {
      if (decoder.width_ticks(i) != widths[i]) {
        return false;
      }
    }
    return true;
  }
};

}  // namespace

TEST_CASE("frame times from 14 to 22.5 ms, one channel after the other or all at once") {
  const uint16_t frames_us[] = {14000, 18000, 20000, 20050, 22500};
  for (const uint16_t frame_us : frames_us) {
    for (uint8_t kind = 0; kind < 2; ++kind) {
      Receiver receiver;
      receiver.frame_ticks = frame_us * 2U;
      receiver.sequential = kind == 0;
      receiver.frames(20);
      CHECK(receiver.all_right());
      CHECK_EQ(receiver.decoder.valid(), kAll);
      CHECK_EQ(receiver.decoder.steady(), kAll);
      CHECK_EQ(receiver.decoder.glitches(), 0);
      CHECK(receiver.decoder.frame_us() >= frame_us - 10);
      CHECK(receiver.decoder.frame_us() <= frame_us + 10);
    }
  }
}

TEST_CASE("every width from 800 to 2200 us, unchanged; none beyond") {
  Receiver receiver;
  const uint16_t widths[] = {1600, 1601, 1959, 2999, 4060, 4399, 4400};
  for (const uint16_t width : widths) {
    receiver.widths[1] = width;
    receiver.frame();
    CHECK_EQ(receiver.decoder.width_ticks(1), width);
  }
  receiver.widths[1] = 4401;
  receiver.frame();
  CHECK_EQ(receiver.decoder.width_ticks(1), 4400);
  receiver.widths[1] = 1599;
  receiver.frame();
  CHECK_EQ(receiver.decoder.width_ticks(1), 4400);
}

TEST_CASE("nothing is invented before the first pulse, and three make a channel steady") {
  Receiver receiver;
  receiver.sent = 0;
  receiver.frames(3);
  CHECK_EQ(receiver.decoder.width_ticks(0), 0);
  receiver.sent = kAll;
  receiver.frame();
  CHECK(receiver.all_right());
  CHECK_EQ(receiver.decoder.steady(), 0);
  receiver.frames(2);
  CHECK_EQ(receiver.decoder.steady(), kAll);
}

TEST_CASE("a pulse behind a missed one counts") {
  Receiver receiver;
  receiver.frames(5);
  receiver.sent = 0b1'1110;
  receiver.frame();
  receiver.sent = kAll;
  receiver.widths[0] = 3100;
  receiver.frame();
  CHECK_EQ(receiver.decoder.width_ticks(0), 3100);
  CHECK_EQ(receiver.decoder.glitches(), 0);
}

TEST_CASE("one channel lost: that one within 60 ms, the others untouched") {
  Receiver receiver;
  receiver.frames(5);
  receiver.sent = 0b1'1011;
  receiver.frame();
  CHECK_EQ(receiver.decoder.fresh(), kAll);
  receiver.frame();
  CHECK_EQ(receiver.decoder.fresh(), 0b1'1011);
  CHECK_EQ(receiver.decoder.valid(), kAll);
  receiver.wait_until(receiver.now + 5 * kMs);
  CHECK_EQ(receiver.decoder.valid(), 0b1'1011);
  CHECK_EQ(receiver.decoder.width_ticks(2), 0);
  CHECK_EQ(receiver.decoder.width_ticks(3), 2000);
}

TEST_CASE("all lost: no width is held, and steadiness starts over") {
  Receiver receiver;
  receiver.frames(5);
  receiver.sent = 0;
  receiver.frames(4);
  CHECK_EQ(receiver.decoder.valid(), 0);
  CHECK_EQ(receiver.decoder.steady(), 0);
  CHECK_EQ(receiver.decoder.frame_us(), 0);
  receiver.sent = kAll;
  receiver.frames(2);
  CHECK(receiver.all_right());
  CHECK_EQ(receiver.decoder.steady(), 0);
  receiver.frame();
  CHECK_EQ(receiver.decoder.steady(), kAll);
  CHECK(receiver.decoder.frame_us() >= 19990);
  CHECK(receiver.decoder.frame_us() <= 20010);
}

TEST_CASE("fresh says that at most one frame is missing") {
  Receiver receiver;
  receiver.frames(5);
  receiver.sent = 0;
  receiver.wait_until(receiver.now + 22 * kMs);
  CHECK_EQ(receiver.decoder.fresh(), kAll);
  receiver.wait_until(receiver.now + 13 * kMs);
  CHECK_EQ(receiver.decoder.fresh() & 1, 0);
  CHECK_EQ(receiver.decoder.valid(), kAll);
}

TEST_CASE("channels that rise at once are unsteady at once") {
  Receiver receiver;
  receiver.sequential = false;
  receiver.frames(5);
  receiver.sent = 0;
  uint8_t turns = 0;
  for (; turns < 100 && receiver.decoder.steady() == kAll; ++turns) {
    receiver.wait_until(receiver.now + kMs);
  }
  CHECK(turns < 100);
  CHECK_EQ(receiver.decoder.steady(), 0);
  CHECK_EQ(receiver.decoder.valid(), kAll);
}

TEST_CASE("a late stamp costs its pulse, never a wrong width") {
  Receiver receiver;
  receiver.sequential = false;
  receiver.frames(5);
  receiver.set(1, true, true);  // stamped 40 us too late
  receiver.wait_until(receiver.now + 2920);
  receiver.set(1, false);
  receiver.wait_until(receiver.now + 17 * kMs);
  CHECK_EQ(receiver.decoder.width_ticks(0), 3000);
  receiver.set(1, true);
  receiver.wait_until(receiver.now + 3080);
  receiver.set(1, false, true);
  receiver.wait_until(receiver.now + 17 * kMs);
  CHECK_EQ(receiver.decoder.width_ticks(0), 3000);
  CHECK_EQ(receiver.decoder.glitches(), 2);
}

TEST_CASE("a dropout inside a pulse leaves none of its halves") {
  Receiver receiver;
  receiver.frames(5);
  receiver.pulse(1, 1800);
  receiver.wait_until(receiver.now + 100);
  receiver.pulse(1, 2100);
  receiver.wait_until(receiver.now + 10 * kMs);
  CHECK_EQ(receiver.decoder.width_ticks(0), 3000);
}

TEST_CASE("a false pulse of a good width between true ones is refused by its time") {
  Receiver receiver;
  receiver.sequential = false;
  receiver.frames(10);
  uint8_t wrong = 0;
  for (uint8_t round = 0; round < 20; ++round) {
    const uint32_t end = receiver.now + 20 * kMs;
    receiver.simultaneous();
    receiver.wait_until(receiver.now + 4 * kMs + round * 400U);
    receiver.pulse(kAll, 2600);
    receiver.wait_until(end);
    wrong = static_cast<uint8_t>(wrong + !receiver.all_right());
  }
  CHECK_EQ(wrong, 0);
  CHECK_EQ(receiver.decoder.glitches(), 100);
}

TEST_CASE("noise of 50 us to 10 ms between true pulses moves no width") {
  Random random(4);
  Receiver receiver;
  receiver.sequential = false;
  receiver.frames(10);
  uint8_t wrong = 0;
  for (uint8_t round = 0; round < 60; ++round) {
    const uint32_t end = receiver.now + 20 * kMs;
    receiver.simultaneous();
    receiver.wait_until(receiver.now + 1 * kMs);
    receiver.pulse(0b1'0101, static_cast<uint16_t>(100 + random.below(19000)));
    receiver.wait_until(end);
    wrong = static_cast<uint8_t>(wrong + !receiver.all_right());
  }
  CHECK_EQ(wrong, 0);
  CHECK(receiver.decoder.glitches() >= 150);
}

TEST_CASE("a burst of 10 kHz is no pulse, and true ones come back behind it") {
  Receiver receiver;
  receiver.frames(5);
  for (uint16_t i = 0; i < 700; ++i) {
    receiver.set(kAll, true);
    receiver.wait_until(receiver.now + 100);
    receiver.set(kAll, false);
    receiver.wait_until(receiver.now + 100);
  }
  CHECK_EQ(receiver.decoder.valid(), 0);
  receiver.wait_until(receiver.now + 5 * kMs);
  receiver.frames(3);
  CHECK(receiver.all_right());
  CHECK_EQ(receiver.decoder.steady(), kAll);
}

TEST_CASE("a storm loses every channel at once") {
  Receiver receiver;
  receiver.frames(5);
  receiver.decoder.storm();
  CHECK_EQ(receiver.decoder.valid(), 0);
  CHECK_EQ(receiver.decoder.fresh(), 0);
  CHECK_EQ(receiver.decoder.steady(), 0);
  CHECK_EQ(receiver.decoder.width_ticks(4), 0);
  receiver.frames(4);
  CHECK(receiver.all_right());
}

TEST_CASE("a pulse begun before a storm does not count") {
  Receiver receiver;
  receiver.frames(5);
  receiver.set(1, true);
  receiver.wait_until(receiver.now + 1500);
  receiver.decoder.storm();
  receiver.wait_until(receiver.now + 1500);
  receiver.set(1, false);
  receiver.wait_until(receiver.now + 10 * kMs);
  CHECK_EQ(receiver.decoder.width_ticks(0), 0);
}

TEST_CASE("behind lost edges no channel's waiting pulse counts") {
  Receiver receiver;
  receiver.frames(5);
  receiver.pulse(2, 3100);
  receiver.decoder.gap();
  receiver.pulse(1, 3000);
  receiver.set(2, true);
  receiver.wait_until(receiver.now + kMs);
  CHECK_EQ(receiver.decoder.width_ticks(1), receiver.widths[1]);
}

TEST_CASE("edges lost in the ring cost one frame, not a wrong width") {
  Receiver receiver;
  receiver.sequential = false;
  receiver.frames(5);
  receiver.set(kAll, true);
  receiver.decoder.gap();
  receiver.wait_until(receiver.now + 2500);
  receiver.set(kAll, false);
  receiver.wait_until(receiver.now + 17 * kMs);
  CHECK(receiver.all_right());
  receiver.widths[0] = 3333;
  receiver.frame();
  CHECK(receiver.all_right());
}

TEST_CASE("four sticks moved at once in one frame shift the last channel, not lose it") {
  Receiver receiver;
  receiver.frame_ticks = 14 * kMs;
  for (uint8_t i = 0; i < 4; ++i) {
    receiver.widths[i] = 4200;
  }
  receiver.widths[4] = 3000;
  receiver.frames(6);
  for (uint8_t i = 0; i < 4; ++i) {
    receiver.widths[i] = 2000;
  }
  receiver.widths[4] = 3100;
  receiver.frame();
  CHECK(receiver.all_right());
  CHECK_EQ(receiver.decoder.glitches(), 0);
}

TEST_CASE("a faster receiver is followed after a slower one") {
  Receiver receiver;
  receiver.frame_ticks = 45000;
  receiver.frames(20);
  receiver.frame_ticks = 28000;
  receiver.frames(60);
  const uint16_t before = receiver.decoder.glitches();
  receiver.frames(20);
  CHECK_EQ(receiver.decoder.glitches(), before);
  CHECK(receiver.decoder.frame_us() >= 13980);
  CHECK(receiver.decoder.frame_us() <= 14020);
}

TEST_CASE("a 16-bit stamp finds its place on the 32-bit clock") {
  CHECK(core::extend_ticks(0x00010005U, 0x0003) == 0x00010003U);
  CHECK(core::extend_ticks(0x00010005U, 0xFFF0) == 0x0000FFF0U);
  CHECK(core::extend_ticks(0x00000002U, 0xFFFF) == 0xFFFFFFFFU);
}

TEST_CASE("random widths on any receiver come out as they went in") {
  Random random(5);
  for (uint8_t kind = 0; kind < 6; ++kind) {
    Receiver receiver;
    receiver.sequential = kind % 2 == 0;
    receiver.frame_ticks = 28000U + random.below(17000);
    receiver.frames(4);
    uint8_t wrong = 0;
    for (uint8_t round = 0; round < 60; ++round) {
      for (uint16_t& width : receiver.widths) {
        width = static_cast<uint16_t>(1900 + random.below(2300));
      }
      receiver.frame();
      wrong = static_cast<uint8_t>(wrong + !receiver.all_right());
    }
    CHECK_EQ(wrong, 0);
  }
}

TEST_CASE("all channels at once at 333 Hz are refused, and that is said; 200 Hz is used") {
  core::RcDecoder decoder;
  uint32_t t_ticks = 0xFFFF0000U;
  const auto fly = [&](uint32_t period_ticks, uint16_t frames) {
    for (uint16_t i = 0; i < frames; ++i) {
      decoder.edge(t_ticks, kAll, false);
      decoder.edge(t_ticks + 3000, 0, false);
      decoder.poll(t_ticks + 3000 + 700);
      t_ticks += period_ticks;
    }
  };
  fly(6000, 40);
  CHECK_EQ(decoder.refused_hz(), 0);
  fly(6000, 40);
  CHECK_EQ(decoder.refused_hz(), 333);
  CHECK_EQ(decoder.valid(), 0);
  fly(10000, 10);
  CHECK_EQ(decoder.refused_hz(), 0);
  CHECK_EQ(decoder.valid(), kAll);
}
