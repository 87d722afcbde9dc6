// u-blox bytes, one at a time.
#include <string.h>

#include "check.h"
#include "core/bytes.h"
#include "core/gps_receiver.h"
#include "random_numbers.h"

namespace {

constexpr uint32_t kItowMs = 385200400U;  // Thursday

// Collects messages as they go over the wire.
struct Wire {
  uint8_t bytes[110];

  uint8_t posllh(uint32_t itow_ms, int32_t latitude, int32_t longitude) {
    uint8_t payload[28] = {};
    core::put_le(payload, itow_ms);
    core::put_le(payload + 4, longitude);
    core::put_le(payload + 8, latitude);
    core::put_le(payload + 12, int32_t{80000});
    core::put_le(payload + 16, int32_t{74321});
    core::put_le(payload + 20, uint32_t{2345});
    core::put_le(payload + 24, uint32_t{3456});
    return core::put_ubx(bytes, 0x01, 0x02, payload, 28);
  }
  uint8_t sol(uint32_t itow_ms, uint8_t fix, uint8_t flags) {
    uint8_t payload[52] = {};
    core::put_le(payload, itow_ms);
    core::put_le(payload + 8, uint16_t{1856});
    payload[10] = fix;
    payload[11] = flags;
    payload[47] = 9;
    return core::put_ubx(bytes, 0x01, 0x06, payload, 52);
  }
  uint8_t velned(uint32_t itow_ms) {
    uint8_t payload[36] = {};
    core::put_le(payload, itow_ms);
    core::put_le(payload + 4, int32_t{1234});
    core::put_le(payload + 8, int32_t{-567});
    core::put_le(payload + 12, int32_t{40000});  // 400 m/s: beyond the frame
    core::put_le(payload + 20, uint32_t{1358});
    core::put_le(payload + 24, int32_t{33512345});
    core::put_le(payload + 28, uint32_t{55});
    return core::put_ubx(bytes, 0x01, 0x12, payload, 36);
  }
  uint8_t pvt(uint32_t itow_ms, uint16_t year, uint8_t month, uint8_t day) {
    uint8_t payload[92] = {};
    core::put_le(payload, itow_ms);
    core::put_le(payload + 4, year);
    payload[6] = month;
    payload[7] = day;
    payload[11] = 0b0111;
    payload[20] = 3;
    payload[21] = 1;
    payload[23] = 12;
    core::put_le(payload + 24, int32_t{312500000});
    core::put_le(payload + 28, int32_t{-300500000});
    core::put_le(payload + 36, int32_t{-12000});
    core::put_le(payload + 40, uint32_t{1000});
    core::put_le(payload + 44, uint32_t{2000});
    core::put_le(payload + 48, int32_t{12340});
    core::put_le(payload + 52, int32_t{-5670});
    core::put_le(payload + 56, int32_t{-90});
    core::put_le(payload + 60, int32_t{13580});
    core::put_le(payload + 64, int32_t{9000000});
    core::put_le(payload + 68, uint32_t{300});
    return core::put_ubx(bytes, 0x01, 0x07, payload, 92);
  }
};

// Feeds a message; true if an epoch came with its last byte and not before.
bool feed(core::GpsReceiver& gps, const uint8_t* bytes, uint8_t size, uint32_t t_us = 0) {
  bool early = false;
  for (uint8_t i = 0; i + 1 < size; ++i) {
    early = early || gps.byte(bytes[i], t_us + i);
  }
  return gps.byte(bytes[size - 1], t_us + size) && !early;
}

}  // namespace

TEST_CASE("POSLLH, SOL and VELNED of one time of week make a frame") {
  core::GpsReceiver gps;
  Wire wire;
  CHECK(!feed(gps, wire.bytes, wire.posllh(kItowMs, 300500000, 312500000), 5000));
  CHECK(!feed(gps, wire.bytes, wire.sol(kItowMs, 3, 0b1101), 9000));
  REQUIRE(feed(gps, wire.bytes, wire.velned(kItowMs), 15000));
  const frames::GpsFrame frame = gps.frame();
  const uint32_t t_us = frame.t_us;
  const uint32_t itow_ms = frame.itow_ms;
  const int32_t latitude = frame.latitude;
  const int32_t longitude = frame.longitude;
  const int32_t height = frame.height;
  CHECK(t_us == 5000U);  // the first byte of the first message
  CHECK(itow_ms == kItowMs);
  CHECK(latitude == 300500000);
  CHECK(longitude == 312500000);
  CHECK(height == 74321);
  CHECK_EQ(frame.week, 1856);
  CHECK_EQ(frame.v_north, 1234);
  CHECK_EQ(frame.v_east, -567);
  CHECK_EQ(frame.v_down, frames::kGpsVDownInvalid);
  CHECK_EQ(frame.ground_speed, 1358);
  CHECK_EQ(frame.course, 33512);
  CHECK_EQ(frame.h_accuracy, 234);
  CHECK_EQ(frame.v_accuracy, 345);
  CHECK_EQ(frame.s_accuracy, 55);
  CHECK_EQ(frame.fix, 3);
  CHECK_EQ(frame.satellites, 9);
  CHECK_EQ(frame.source, 1);
  CHECK_EQ(gps.messages(), 3);
  CHECK_EQ(gps.errors(), 0);
  feed(gps, wire.bytes, wire.posllh(kItowMs + 200, 300500000, 312500000));
  CHECK_EQ(gps.frame().fix, 3);
  CHECK_EQ(gps.frame().satellites, 9);
}

TEST_CASE("a message of another epoch starts over") {
  core::GpsReceiver gps;
  Wire wire;
  feed(gps, wire.bytes, wire.posllh(kItowMs, 1, 1));
  feed(gps, wire.bytes, wire.sol(kItowMs, 3, 0b1101));
  CHECK(!feed(gps, wire.bytes, wire.velned(kItowMs + 200)));
  CHECK(!feed(gps, wire.bytes, wire.posllh(kItowMs + 200, 2, 2)));
  CHECK(feed(gps, wire.bytes, wire.sol(kItowMs + 200, 3, 0b1101)));
}

TEST_CASE("between two epochs fix, satellites and ground speed are the last") {
  core::GpsReceiver gps;
  Wire wire;
  feed(gps, wire.bytes, wire.posllh(kItowMs, 1, 1));
  feed(gps, wire.bytes, wire.sol(kItowMs, 3, 0b1101));
  CHECK_EQ(gps.frame().ground_speed, frames::kGpsGroundSpeedInvalid);
  CHECK_EQ(feed(gps, wire.bytes, wire.velned(kItowMs)), 1);
  const uint8_t size = wire.posllh(kItowMs + 200, 1, 1);
  uint8_t holes = 0;
  for (uint8_t i = 0; i < size; ++i) {
    gps.byte(wire.bytes[i], 0);
    const frames::GpsFrame& seen = gps.frame();
    holes = static_cast<uint8_t>(holes + (seen.ground_speed != 1358 || seen.fix != 3));
  }
  CHECK_EQ(holes, 0);
  CHECK_EQ(gps.frame().satellites, 9);
}

TEST_CASE("a damaged message takes its epoch with it, never mixes into the next") {
  core::GpsReceiver gps;
  Wire wire;
  feed(gps, wire.bytes, wire.posllh(kItowMs, 300500000, 312500000));
  feed(gps, wire.bytes, wire.sol(kItowMs, 3, 0b1101));
  const uint8_t size = wire.velned(kItowMs);
  wire.bytes[10] = static_cast<uint8_t>(wire.bytes[10] ^ 1);  // v_north
  CHECK(!feed(gps, wire.bytes, size));
  CHECK_EQ(gps.errors(), 1);
  CHECK(!feed(gps, wire.bytes, wire.velned(kItowMs)));
  CHECK(!feed(gps, wire.bytes, wire.sol(kItowMs + 200, 3, 0b1101)));
  CHECK(!feed(gps, wire.bytes, wire.velned(kItowMs + 200)));
  REQUIRE(feed(gps, wire.bytes, wire.posllh(kItowMs + 200, 1, 2)));
  const int32_t latitude = gps.frame().latitude;
  CHECK(latitude == 1);
  CHECK_EQ(gps.frame().v_north, 1234);
}

TEST_CASE("NAV-PVT alone makes a frame, its week from the date") {
  core::GpsReceiver gps;
  Wire wire;
  REQUIRE(feed(gps, wire.bytes, wire.pvt(kItowMs, 2015, 8, 6)));
  const frames::GpsFrame frame = gps.frame();
  const int32_t latitude = frame.latitude;
  const int32_t height = frame.height;
  CHECK(latitude == -300500000);
  CHECK(height == -12000);
  CHECK_EQ(frame.week, 1856);
  CHECK_EQ(frame.v_north, 1234);
  CHECK_EQ(frame.v_down, -9);
  CHECK_EQ(frame.course, 9000);
  CHECK_EQ(frame.s_accuracy, 30);
  // Saturday in UTC, Sunday in GPS time: the week is the one that has just begun.
  REQUIRE(feed(gps, wire.bytes, wire.pvt(3000, 2015, 8, 8)));
  CHECK_EQ(gps.frame().week, 1857);
  // The same epoch in the old messages is not logged twice.
  feed(gps, wire.bytes, wire.posllh(3000, 1, 1));
  feed(gps, wire.bytes, wire.sol(3000, 3, 0b1101));
  CHECK(!feed(gps, wire.bytes, wire.velned(3000)));
}

TEST_CASE("without a fix, or far off the globe, there is no position") {
  core::GpsReceiver gps;
  Wire wire;
  feed(gps, wire.bytes, wire.posllh(kItowMs, 0, 0));
  feed(gps, wire.bytes, wire.sol(kItowMs, 0, 0));
  REQUIRE(feed(gps, wire.bytes, wire.velned(kItowMs)));
  const int32_t none = gps.frame().latitude;
  const uint32_t itow_ms = gps.frame().itow_ms;
  CHECK(none == frames::kGpsLatitudeInvalid);
  CHECK(itow_ms == frames::kGpsItowMsInvalid);
  CHECK_EQ(gps.frame().week, 0);
  CHECK_EQ(gps.frame().fix, 0);
  feed(gps, wire.bytes, wire.posllh(kItowMs + 200, 1000000000, 1000000000));
  feed(gps, wire.bytes, wire.sol(kItowMs + 200, 3, 0b1101));
  REQUIRE(feed(gps, wire.bytes, wire.velned(kItowMs + 200)));
  const int32_t latitude = gps.frame().latitude;
  const int32_t longitude = gps.frame().longitude;
  CHECK(latitude == frames::kGpsLatitudeInvalid);
  CHECK(longitude == 1000000000);
}

TEST_CASE("every flipped bit of a message is noticed, and the next message is whole") {
  core::GpsReceiver gps;
  Wire wire;
  const uint8_t size = wire.velned(kItowMs);
  uint16_t passed = 0;
  uint16_t recovered = 0;
  for (uint16_t bit = 16; bit < size * 8; ++bit) {
    const uint16_t before = gps.messages();
    wire.bytes[bit / 8] = static_cast<uint8_t>(wire.bytes[bit / 8] ^ 1U << bit % 8);
    feed(gps, wire.bytes, size);
    wire.bytes[bit / 8] = static_cast<uint8_t>(wire.bytes[bit / 8] ^ 1U << bit % 8);
    passed = static_cast<uint16_t>(passed + (gps.messages() != before));
    // A longer length swallows what follows, at most 512 bytes: then it must be found again.
    for (uint8_t i = 0; i < 16 && gps.messages() == before; ++i) {
      feed(gps, wire.bytes, size);
    }
    recovered = static_cast<uint16_t>(recovered + (gps.messages() != before));
  }
  CHECK_EQ(passed, 0);
  CHECK_EQ(recovered, size * 8 - 16);
  CHECK(gps.errors() >= 300);
}

TEST_CASE("noise and NMEA between messages cost nothing; pure noise makes no frame") {
  core::GpsReceiver gps;
  Wire wire;
  const char nmea[] = "$GPGGA,092725.00,4717.11,N,00833.91,E,1,8,1.01,499.6,M*5B\r\n\xB5\xB5";
  uint8_t frames_made = 0;
  for (uint8_t i = 0; i < 5; ++i) {
    for (const char letter : nmea) {
      gps.byte(static_cast<uint8_t>(letter), 0);
    }
    feed(gps, wire.bytes, wire.posllh(kItowMs + i, 1, 1));
    feed(gps, wire.bytes, wire.sol(kItowMs + i, 3, 0b1101));
    frames_made =
        static_cast<uint8_t>(frames_made + feed(gps, wire.bytes, wire.velned(kItowMs + i)));
  }
  CHECK_EQ(frames_made, 5);
  uint32_t random = 9;
  uint8_t invented = 0;
  for (uint16_t i = 0; i < 20000; ++i) {
    next_random(random);
    const uint8_t dice = static_cast<uint8_t>(random >> 24);
    const uint8_t value = dice < 40 ? 0xB5 : dice < 80 ? 0x62 : static_cast<uint8_t>(random >> 16);
    invented = static_cast<uint8_t>(invented + gps.byte(value, 0));
  }
  CHECK_EQ(invented, 0);
}

TEST_CASE("a message is built as u-blox prints it") {
  // CFG-RATE 200 ms, from the MultiWii sources.
  const uint8_t expected[] = {
      0xB5, 0x62, 0x06, 0x08, 0x06, 0x00, 0xC8, 0x00, 0x01, 0x00, 0x01, 0x00, 0xDE, 0x6A};
  const uint8_t payload[] = {0xC8, 0x00, 0x01, 0x00, 0x01, 0x00};
  uint8_t bytes[14];
  CHECK_EQ(core::put_ubx(bytes, 0x06, 0x08, payload, 6), 14);
  CHECK(memcmp(bytes, expected, 14) == 0);
}

TEST_CASE("the date of a file from week and time of week, as Python's calendar has it") {
  CHECK(core::fat_time(2394, 385200000U) == 0x5B7B5775U);  // 2025-11-27 10:59:42
  CHECK(core::fat_time(2200, 5000U) == 0x5465BF77U);       // 2022-03-05 23:59:47
  CHECK(core::fat_time(2407, 0U) == 0x5C55BF75U);          // 2026-02-21 23:59:42
  CHECK(core::fat_time(2407 - 2048, 0U) == 0x5C55BF75U);   // a receiver that counts from 2019
  CHECK(core::fat_time(0, 0) == 0U);
  CHECK(core::fat_time(2300, 604800000U) == 0U);
}
