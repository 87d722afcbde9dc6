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
