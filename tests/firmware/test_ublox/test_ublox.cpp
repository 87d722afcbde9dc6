// Finding and configuring a receiver whose baud is not known.
#include <string.h>

#include "check.h"
#include "core/gps_receiver.h"
#include "drivers/ublox.h"

namespace {

// A receiver that hears only at its own baud, obeys CFG-PRT and counts the rest.
class ModelReceiver {
 public:
  uint32_t baud = 9600;
  bool present = true;
  uint8_t set_up = 0;  // messages understood behind CFG-PRT
  uint16_t sent = 0;   // navigation messages
  uint8_t refuse = 0;  // sends for which the port has no room
  uint32_t port_baud = 0;

  void set_baud(uint32_t value) { port_baud = value; }
  bool send(const uint8_t* bytes, uint8_t size) {
    if (refuse != 0) {
      --refuse;
      return false;
    }
    if (!present || port_baud != baud) {
      return true;  // garbage on its line
    }
    for (uint8_t i = 0; i < size; ++i) {
      const core::UbxEvent event = parser_.byte(bytes[i], 0);
      if (event == core::UbxEvent::kWord && parser_.offset() == 8) {
        wanted_baud_ = parser_.word();
      } else if (event == core::UbxEvent::kWord && parser_.offset() == 12) {
        wanted_out_ = static_cast<uint8_t>(parser_.word() >> 16);
      } else if (event == core::UbxEvent::kMessage) {
        obey();
      }
    }
    return true;
  }
  // Every 200 ms.
  void tick() {
    if (present && port_baud == baud && ubx_only_ && set_up >= 4) {
      ++sent;
    }
  }
  void power_cycle() {
    baud = 9600;
    ubx_only_ = false;
    set_up = 0;
  }

 private:
  void obey() {
    if (parser_.message_class() != 0x06) {
      return;
    }
    if (parser_.message_id() == 0x00 && parser_.length() == 20) {
      baud = wanted_baud_;
      ubx_only_ = wanted_out_ == 1;
      return;
    }
    ++set_up;
  }

  core::UbxParser parser_;
  uint32_t wanted_baud_ = 0;
  uint8_t wanted_out_ = 0;
  bool ubx_only_ = false;
};

struct Bench {
  ModelReceiver model;
  drivers::Ublox<ModelReceiver> ublox{model};
  uint32_t now_us = 0xFFF00000U;

  uint32_t run_ms(uint16_t limit_ms) {
    for (uint16_t ms = 0; ms < limit_ms; ++ms) {
      now_us += 1000;
      if (ms % 200 == 0) {
        model.tick();
      }
      ublox.poll(model.sent, now_us);
      if (ublox.found()) {
        return ms;
      }
    }
    return limit_ms;
  }
};

}  // namespace

TEST_CASE("a receiver at any usual baud is found, moved to 38400 and set up") {
  const uint32_t bauds[] = {38400, 9600, 57600, 115200, 19200, 4800};
  for (const uint32_t baud : bauds) {
    Bench bench;
    bench.model.baud = baud;
    CHECK(bench.run_ms(10000) < 9000U);
    CHECK(bench.model.baud == 38400U);
    CHECK(bench.model.port_baud == 38400U);
    CHECK(bench.model.set_up >= 6);
  }
}

TEST_CASE("one that is already set up is heard within half a second") {
  Bench bench;
  bench.model.baud = 38400;
  CHECK(bench.run_ms(3000) < 500U);
}

TEST_CASE("a port without room delays, nothing is left out") {
  Bench bench;
  bench.model.baud = 38400;
  bench.model.refuse = 20;
  CHECK(bench.run_ms(3000) < 600U);
  CHECK_EQ(bench.model.set_up, 6);
}

TEST_CASE("nobody there: the search goes on, and finds whoever is plugged in later") {
  Bench bench;
  bench.model.present = false;
  CHECK(bench.run_ms(20000) == 20000U);
  bench.model.present = true;
  CHECK(bench.run_ms(12000) < 11000U);
}

TEST_CASE("one that falls silent, as after a brown-out, is set up again") {
  Bench bench;
  REQUIRE(bench.run_ms(10000) < 9000U);
  bench.model.power_cycle();
  for (uint16_t ms = 0; ms < 5100 && bench.ublox.found(); ++ms) {
    bench.now_us += 1000;
    bench.ublox.poll(bench.model.sent, bench.now_us);
  }
  CHECK(!bench.ublox.found());
  CHECK(bench.run_ms(10000) < 9000U);
  CHECK(bench.model.baud == 38400U);
}

namespace {

// What the driver does to its port, byte by byte.
class Wire {
 public:
  uint8_t bytes[300];
  uint16_t count = 0;
  uint8_t bauds = 0;  // how often it was set
  uint32_t baud = 0;
  uint16_t room = 0xFFFF;  // bytes it takes yet

  void set_baud(uint32_t value) {
    baud = value;
    ++bauds;
  }
  bool send(const uint8_t* sent, uint8_t size) {
    CHECK_EQ(size, 1);
    if (room == 0 || count == sizeof(bytes)) {
      return false;
    }
    --room;
    bytes[count++] = *sent;
    return true;
  }
};

struct Line {
  Wire wire;
  drivers::Ublox<Wire> ublox{wire};
  uint32_t now_us = 0xFFFA0000U;  // it comes round within the first wait
  uint16_t messages = 0;

  void poll(uint32_t after_us = 0) {
    now_us += after_us;
    ublox.poll(messages, now_us);
  }
  // From a try to the start of listening, each step at its very end.
  void dialogue() {
    poll();
    poll();
    poll(150000);
    for (uint8_t step = 0; step < 7; ++step) {
      poll(7);
    }
  }
};

// Receiver description, 24: sync, class, id, length, payload, and the 8-bit Fletcher sums behind.
const uint8_t kPortFrame[] = {0xB5, 0x62, 0x06, 0x00, 20, 0, 1, 0, 0, 0, 0xD0, 0x08, 0,    0,
                              0x00, 0x96, 0,    0,    3,  0, 1, 0, 0, 0, 0,    0,    0x8D, 0x64};
const uint8_t kSetupFrames[] = {
    0xB5, 0x62, 0x06, 0x08, 6,  0, 0xC8, 0,    1, 0,    1,    0, 0xDE, 0x6A,  // 200 ms
    0xB5, 0x62, 0x06, 0x01, 3,  0, 0x01, 0x02, 1, 0x0E, 0x47,                 // POSLLH
    0xB5, 0x62, 0x06, 0x01, 3,  0, 0x01, 0x06, 1, 0x12, 0x4F,                 // SOL
    0xB5, 0x62, 0x06, 0x01, 3,  0, 0x01, 0x12, 1, 0x1E, 0x67,                 // VELNED
    0xB5, 0x62, 0x06, 0x01, 3,  0, 0x01, 0x07, 1, 0x13, 0x51,                 // PVT
    0xB5, 0x62, 0x06, 0x24, 36, 0, 0x01, 0,    8, 0,    0,    0, 0,    0,     // airborne below 4 g
    0,    0,    0,    0,    0,  0, 0,    0,    0, 0,    0,    0, 0,    0,    0,
    0,    0,    0,    0,    0,  0, 0,    0,    0, 0,    0,    0, 0,    0x57, 0xF8};

}  // namespace

TEST_CASE("every byte is that of the receiver's description, each step at its time") {
  Line line;
  Wire& wire = line.wire;
  line.poll();
  CHECK_EQ(wire.bauds, 1);
  CHECK(wire.baud == 38400U);
  CHECK_EQ(wire.count, 0);
  line.poll(3);
  REQUIRE(wire.count == sizeof(kPortFrame));
  CHECK_EQ(memcmp(wire.bytes, kPortFrame, sizeof(kPortFrame)), 0);
  line.poll(149999);
  CHECK_EQ(wire.bauds, 1);
  line.poll(1);
  CHECK_EQ(wire.bauds, 2);
  CHECK(wire.baud == 38400U);
  CHECK_EQ(wire.count, sizeof(kPortFrame));
  wire.count = 0;
  const uint16_t ends[] = {14, 25, 36, 47, 58, 102};
  for (const uint16_t end : ends) {
    line.poll(1);
    CHECK_EQ(wire.count, end);
  }
  REQUIRE(wire.count == sizeof(kSetupFrames));
  CHECK_EQ(memcmp(wire.bytes, kSetupFrames, sizeof(kSetupFrames)), 0);
  line.poll(1);
  CHECK(!line.ublox.found());
  CHECK_EQ(wire.count, sizeof(kSetupFrames));
}

TEST_CASE("a port that takes some bytes at a time gets the same ones") {
  for (uint16_t room = 1; room < 40; room = static_cast<uint16_t>(room + 2)) {
    Line line;
    Wire& wire = line.wire;
    line.poll();
    for (uint8_t turn = 0; turn < 40 && wire.count < sizeof(kPortFrame); ++turn) {
      wire.room = room;
      line.poll(1);
    }
    wire.room = 0;
    CHECK_EQ(wire.bauds, 1);
    line.poll(150000);
    CHECK_EQ(wire.bauds, 2);
    const uint16_t setup = sizeof(kPortFrame) + sizeof(kSetupFrames);
    for (uint8_t turn = 0; turn < 150 && wire.count < setup; ++turn) {
      wire.room = room;
      line.poll(1);
    }
    REQUIRE(wire.count == setup);
    CHECK_EQ(memcmp(wire.bytes, kPortFrame, sizeof(kPortFrame)), 0);
    CHECK_EQ(memcmp(wire.bytes + sizeof(kPortFrame), kSetupFrames, sizeof(kSetupFrames)), 0);
  }
}

TEST_CASE("the bauds are tried in their order, 1.3 s each, and from the first again") {
  const uint32_t bauds[] = {38400, 9600, 57600, 115200, 19200, 4800, 38400};
  Line line;
  for (const uint32_t baud : bauds) {
    line.poll();
    CHECK(line.wire.baud == baud);
    line.poll();
    line.poll(150000);
    CHECK(line.wire.baud == 38400U);
    for (uint8_t step = 0; step < 7; ++step) {
      line.poll();
    }
    line.wire.count = 0;
    const uint8_t before = line.wire.bauds;
    line.poll(1299999);
    line.poll();  // what a late turn would do: nothing yet
    CHECK_EQ(line.wire.bauds, before);
    line.poll(1);
    CHECK_EQ(line.wire.bauds, before);
  }
}

TEST_CASE("only what is heard behind the set-up counts, and five seconds of silence end it") {
  Line line;
  line.messages = 7;  // before: by another baud, or noise
  line.dialogue();
  line.poll(1);
  CHECK(!line.ublox.found());
  line.messages = 8;
  line.poll(1);
  CHECK(line.ublox.found());
  const uint8_t bauds = line.wire.bauds;
  line.poll(4999999);
  CHECK(line.ublox.found());
  line.messages = 9;
  line.poll();
  line.poll(4999999);
  CHECK(line.ublox.found());
  line.poll(1);
  CHECK(!line.ublox.found());
  CHECK_EQ(line.wire.bauds, bauds);
  line.poll();
  CHECK_EQ(line.wire.bauds, bauds + 1);
  CHECK(line.wire.baud == 38400U);
}

TEST_CASE("one that was found at another baud is sought from the first when it falls silent") {
  Line line;
  line.dialogue();
  line.poll(1300000);
  line.dialogue();
  CHECK(!line.ublox.found());
  line.messages = 1;
  line.poll(1);
  CHECK(line.ublox.found());
  line.poll(5000000);
  CHECK(!line.ublox.found());
  line.wire.count = 0;
  line.poll();
  CHECK(line.wire.baud == 38400U);
  line.poll();
  REQUIRE(line.wire.count == sizeof(kPortFrame));
  CHECK_EQ(memcmp(line.wire.bytes, kPortFrame, sizeof(kPortFrame)), 0);
}
