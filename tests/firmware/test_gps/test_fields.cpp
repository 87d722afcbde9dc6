// Every field of each message to its limits, dates against the calendar's own rule, and the time of
// a file.
#include "check.h"
#include "core/bytes.h"
#include "core/gps_receiver.h"
#include "core/ubx.h"

namespace {

constexpr uint32_t kItowMs = 385200400U;
constexpr uint32_t kWeekMs = 604800000U;

// A message whose words are set one by one.
struct Message {
  uint8_t payload[92] = {};
  uint8_t bytes[100];
  uint8_t id;
  uint8_t length;

  Message(uint8_t message_id, uint8_t size, uint32_t itow_ms) : id(message_id), length(size) {
    core::put_le(payload, itow_ms);
  }
  template <typename Value>
  void set(uint8_t offset, Value value) {
    core::put_le(payload + offset, value);
  }
  bool to(core::GpsReceiver& gps) {
    const uint8_t size = core::put_ubx(bytes, 0x01, id, payload, length);
    bool told = false;
    for (uint8_t i = 0; i < size; ++i) {
      told = gps.byte(bytes[i], 77);
    }
    return told;
  }
};

struct Old {
  core::GpsReceiver gps;
  Message posllh{0x02, 28, kItowMs};
  Message sol{0x06, 52, kItowMs};
  Message velned{0x12, 36, kItowMs};

  Old() {
    sol.payload[10] = 3;
    sol.payload[11] = 0b1101;
  }
  frames::GpsFrame epoch() {
    posllh.to(gps);
    sol.to(gps);
    CHECK(velned.to(gps));
    return gps.frame();
  }
};

struct Pvt : Message {
  core::GpsReceiver gps;

  explicit Pvt(uint32_t itow_ms = kItowMs) : Message(0x07, 92, itow_ms) {
    date(2015, 8, 6);
    payload[11] = 0b11;
    payload[20] = 3;
    payload[21] = 1;
  }
  void date(uint16_t year, uint8_t month, uint8_t day) {
    set(4, year);
    payload[6] = month;
    payload[7] = day;
  }
  frames::GpsFrame epoch() {
    CHECK(to(gps));
    return gps.frame();
  }
};

bool leap(uint16_t year) {
  return (year % 4 == 0 && year % 100 != 0) || year % 400 == 0;
}

}  // namespace

TEST_CASE("u-blox 6: each field at its limits") {
  const struct {
    int32_t sent;
    int16_t kept;
  } speeds[] = {
      {32767, 32767}, {32768, INT16_MIN}, {-32767, -32767}, {-32768, INT16_MIN}, {-1, -1}};
  for (const auto& one : speeds) {
    for (uint8_t axis = 0; axis < 3; ++axis) {
      Old old;
      old.velned.set(static_cast<uint8_t>(4 + 4 * axis), one.sent);
      const frames::GpsFrame frame = old.epoch();
      const int16_t kept[] = {frame.v_north, frame.v_east, frame.v_down};
      for (uint8_t i = 0; i < 3; ++i) {
        CHECK_EQ(kept[i], i == axis ? one.kept : 0);
      }
    }
  }
  Old old;
  old.posllh.set(4, int32_t{1800000000});
  old.posllh.set(8, int32_t{-900000000});
  old.posllh.set(12, int32_t{-5});  // above the ellipsoid: nobody keeps it
  old.posllh.set(16, int32_t{-43000});
  old.posllh.set(20, uint32_t{655349});
  old.posllh.set(24, uint32_t{655350});
  old.sol.payload[47] = 200;
  old.velned.set(16, uint32_t{999});  // speed in space
  old.velned.set(20, uint32_t{65534});
  old.velned.set(24, uint32_t{359999999});
  old.velned.set(28, uint32_t{65535});
  old.velned.set(32, uint32_t{12345});
  frames::GpsFrame frame = old.epoch();
  CHECK_EQ(frame.longitude, 1800000000);
  CHECK_EQ(frame.latitude, -900000000);
  CHECK_EQ(frame.height, -43000);
  CHECK_EQ(frame.h_accuracy, 65534);
  CHECK_EQ(frame.v_accuracy, 65535);
  CHECK_EQ(frame.satellites, 200);
  CHECK_EQ(frame.ground_speed, 65534);
  CHECK_EQ(frame.course, UINT16_MAX);  // 359 999 does not fit
  CHECK_EQ(frame.s_accuracy, 65535);
  old.posllh.set(4, int32_t{1800000001});
  old.posllh.set(8, int32_t{-900000001});
  old.velned.set(20, uint32_t{65536});
  old.velned.set(24, int32_t{35999999});
  frame = old.epoch();
  CHECK_EQ(frame.longitude, frames::kGpsLongitudeInvalid);
  CHECK_EQ(frame.latitude, frames::kGpsLatitudeInvalid);
  CHECK_EQ(frame.ground_speed, frames::kGpsGroundSpeedInvalid);
  CHECK_EQ(frame.course, 35999);
  old.posllh.set(4, int32_t{-1800000000});
  old.posllh.set(8, int32_t{900000000});
  frame = old.epoch();
  CHECK_EQ(frame.longitude, -1800000000);
  CHECK_EQ(frame.latitude, 900000000);
  old.posllh.set(4, int32_t{-1800000001});
  old.posllh.set(8, int32_t{900000001});
  frame = old.epoch();
  CHECK_EQ(frame.longitude, frames::kGpsLongitudeInvalid);
  CHECK_EQ(frame.latitude, frames::kGpsLatitudeInvalid);
}

TEST_CASE("u-blox 6: kind of fix, and what of time is known, by its own bit each") {
  for (uint8_t fix = 0; fix < 8; ++fix) {
    for (uint8_t flags = 0; flags < 16; ++flags) {
      Old old;
      old.sol.payload[10] = fix;
      old.sol.payload[11] = flags;
      old.sol.set(8, uint16_t{1856});
      const frames::GpsFrame frame = old.epoch();
      const uint8_t kinds[] = {0, 1, 2, 3, 3, 0, 0, 0};
      CHECK_EQ(frame.fix, (flags & 1U) != 0 ? kinds[fix] : 0);
      CHECK_EQ(frame.week, (flags & 4U) != 0 ? 1856 : frames::kGpsWeekInvalid);
      CHECK_EQ(frame.itow_ms, (flags & 8U) != 0 ? kItowMs : frames::kGpsItowMsInvalid);
      CHECK_EQ(frame.height, frame.fix == 0 ? frames::kGpsHeightInvalid : 0);
      CHECK_EQ(frame.latitude, frame.fix == 0 ? frames::kGpsLatitudeInvalid : 0);
      CHECK_EQ(frame.longitude, frame.fix == 0 ? frames::kGpsLongitudeInvalid : 0);
      CHECK_EQ(frame.source, 1);
    }
  }
}

TEST_CASE("a message of another length is none of these, and makes no epoch") {
  for (uint8_t which = 0; which < 3; ++which) {
    for (int8_t by = -4; by <= 4; by = static_cast<int8_t>(by + 8)) {
      Old old;
      Message* const messages[] = {&old.posllh, &old.sol, &old.velned};
      Message& other = *messages[which];
      old.posllh.set(16, int32_t{111});
      old.posllh.set(8, int32_t{1234});
      old.sol.payload[47] = 7;
      old.velned.set(4, int32_t{222});
      other.length = static_cast<uint8_t>(other.length + by);
      CHECK(!old.posllh.to(old.gps));
      CHECK(!old.sol.to(old.gps));
      CHECK(!old.velned.to(old.gps));
      const frames::GpsFrame frame = old.gps.frame();
      CHECK_EQ(frame.height, which == 0 ? frames::kGpsHeightInvalid : 111);
      CHECK_EQ(frame.satellites, which == 1 ? 0 : 7);
      CHECK_EQ(frame.v_north, which == 2 ? frames::kGpsVNorthInvalid : 222);
    }
  }
  Pvt pvt;
  pvt.length = 80;
  CHECK(!pvt.to(pvt.gps));
  CHECK_EQ(pvt.gps.frame().fix, 0);
  pvt.length = 84;  // u-blox 7's
  CHECK(pvt.to(pvt.gps));
  CHECK_EQ(pvt.gps.frame().fix, 3);
}

TEST_CASE("PVT: every field in the frame's units, each at its limits") {
  Pvt pvt;
  pvt.payload[23] = 31;
  pvt.set(24, int32_t{1800000000});
  pvt.set(28, int32_t{-900000000});
  pvt.set(32, int32_t{-77});
  pvt.set(36, int32_t{-12000});
  pvt.set(40, uint32_t{1009});
  pvt.set(44, uint32_t{2019});
  pvt.set(48, int32_t{327679});
  pvt.set(52, int32_t{-327679});
  pvt.set(56, int32_t{-99});
  pvt.set(60, int32_t{655349});
  pvt.set(64, int32_t{35999999});
  pvt.set(68, uint32_t{309});
  pvt.set(72, uint32_t{0xFFFFFFFF});
  pvt.set(76, uint32_t{0xFFFFFFFF});
  frames::GpsFrame frame = pvt.epoch();
  CHECK_EQ(frame.itow_ms, kItowMs);
  CHECK_EQ(frame.t_us, 77U);
  CHECK_EQ(frame.fix, 3);
  CHECK_EQ(frame.satellites, 31);
  CHECK_EQ(frame.longitude, 1800000000);
  CHECK_EQ(frame.latitude, -900000000);
  CHECK_EQ(frame.height, -12000);
  CHECK_EQ(frame.h_accuracy, 100);
  CHECK_EQ(frame.v_accuracy, 201);
  CHECK_EQ(frame.v_north, 32767);
  CHECK_EQ(frame.v_east, -32767);
  CHECK_EQ(frame.v_down, -9);
  CHECK_EQ(frame.ground_speed, 65534);
  CHECK_EQ(frame.course, 35999);
  CHECK_EQ(frame.s_accuracy, 30);
  CHECK_EQ(frame.source, 1);
  pvt.set(24, int32_t{1800000001});
  pvt.set(28, int32_t{900000001});
  pvt.set(48, int32_t{327680});
  pvt.set(52, int32_t{-327680});
  pvt.set(56, int32_t{327680});
  pvt.set(60, int32_t{-1});
  pvt.set(64, int32_t{-1});
  frame = pvt.epoch();
  CHECK_EQ(frame.longitude, frames::kGpsLongitudeInvalid);
  CHECK_EQ(frame.latitude, frames::kGpsLatitudeInvalid);
  CHECK_EQ(frame.v_north, INT16_MIN);
  CHECK_EQ(frame.v_east, INT16_MIN);
  CHECK_EQ(frame.v_down, INT16_MIN);
  CHECK_EQ(frame.ground_speed, 0);
  CHECK_EQ(frame.course, frames::kGpsCourseInvalid);
  pvt.set(60, int32_t{0});
  pvt.set(64, int32_t{0});
  frame = pvt.epoch();
  CHECK_EQ(frame.ground_speed, 0);
  CHECK_EQ(frame.course, 0);
}

TEST_CASE("PVT: fix by its kind and its bit, week by both valid bits") {
  for (uint8_t fix = 0; fix < 7; ++fix) {
    for (uint8_t flags = 0; flags < 4; ++flags) {
      Pvt pvt;
      pvt.payload[20] = fix;
      pvt.payload[21] = flags;
      const uint8_t kinds[] = {0, 1, 2, 3, 3, 0, 0};
      CHECK_EQ(pvt.epoch().fix, (flags & 1U) != 0 ? kinds[fix] : 0);
    }
  }
  for (uint8_t valid = 0; valid < 16; ++valid) {
    Pvt pvt;
    pvt.payload[11] = valid;
    const frames::GpsFrame frame = pvt.epoch();
    CHECK_EQ(frame.week, (valid & 3U) == 3 ? 1856 : frames::kGpsWeekInvalid);
    CHECK_EQ(frame.itow_ms, (valid & 2U) != 0 ? kItowMs : frames::kGpsItowMsInvalid);
  }
  Pvt last(kWeekMs - 1);
  CHECK_EQ(last.epoch().itow_ms, kWeekMs - 1);
  Pvt none(kWeekMs);
  CHECK_EQ(none.epoch().itow_ms, frames::kGpsItowMsInvalid);
  CHECK_EQ(none.gps.frame().week, frames::kGpsWeekInvalid);
}

TEST_CASE("PVT: the week of the first, the last and the 28th of each month to 2150") {
  uint32_t days = 0;  // since 1980-01-06, of the month's first day
  for (uint16_t year = 1980; year <= 2150; ++year) {
    const uint8_t lengths[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    for (uint8_t month = 1; month <= 12; ++month) {
      const uint8_t length = static_cast<uint8_t>(lengths[month - 1] + (month == 2 && leap(year)));
      const uint8_t looked_at[] = {1, 28, length};
      for (const uint8_t day : looked_at) {
        const int32_t since = static_cast<int32_t>(days) + day - 6;
        if (since < 7 || year % 10 > 4) {
          continue;
        }
        Pvt pvt(static_cast<uint32_t>(since % 7) * 86400000U + 43200000U);
        pvt.date(year, month, day);
        CHECK_EQ(pvt.epoch().week, since / 7);
      }
      days += length;
    }
  }
}

TEST_CASE("PVT: what is no date counts as the first") {
  const struct {
    uint16_t year;
    uint8_t month;
  } none[] = {{1979, 5}, {2151, 1}, {2015, 0}, {2015, 13}};
  for (const auto& one : none) {
    Pvt pvt(0);
    pvt.date(one.year, one.month, 20);
    CHECK_EQ(pvt.epoch().week, 0);
  }
}

TEST_CASE("PVT: near midnight the date is a day behind the time of week") {
  Pvt before(3 * 86400000U + 5000);  // Wednesday by GPS, 23:59:47 of Tuesday by UTC
  before.date(2015, 8, 4);
  CHECK_EQ(before.epoch().week, 1856);
  Pvt sunday(5000);  // the week has just begun, the date is Saturday's
  sunday.date(2015, 8, 8);
  CHECK_EQ(sunday.epoch().week, 1857);
}

TEST_CASE("one that sends PVT is listened to there alone") {
  Old old;
  Pvt pvt;
  pvt.payload[23] = 21;
  CHECK(pvt.to(old.gps));
  old.sol.payload[47] = 4;
  old.velned.set(4, int32_t{99});
  CHECK(!old.posllh.to(old.gps));
  CHECK(!old.sol.to(old.gps));
  CHECK(!old.velned.to(old.gps));
  CHECK_EQ(old.gps.frame().satellites, 21);
  CHECK_EQ(old.gps.frame().v_north, 0);
  CHECK_EQ(old.gps.messages(), 4);
}

TEST_CASE("an error ends the epoch and is counted; other classes are heard and tell nothing") {
  Old old;
  old.posllh.to(old.gps);
  old.sol.to(old.gps);
  Message other(0x12, 36, kItowMs);
  const uint8_t size = core::put_ubx(other.bytes, 0x02, 0x12, other.payload, 36);
  bool told = false;
  for (uint8_t i = 0; i < size; ++i) {
    told = told || old.gps.byte(other.bytes[i], 0);
  }
  CHECK(!told);
  CHECK_EQ(old.gps.messages(), 3);
  other.bytes[size - 1] ^= 1;
  for (uint8_t i = 0; i < size; ++i) {
    told = told || old.gps.byte(other.bytes[i], 0);
  }
  CHECK_EQ(old.gps.errors(), 1);
  CHECK_EQ(old.gps.messages(), 3);
  CHECK(!old.velned.to(old.gps));
  CHECK(!old.posllh.to(old.gps));
  CHECK(old.sol.to(old.gps));
}

TEST_CASE("the time of a file: the calendar's own, 18 s behind GPS, in steps of two seconds") {
  CHECK_EQ(core::fat_time(frames::kGpsWeekInvalid, 0), 0U);
  CHECK_EQ(core::fat_time(2000, kWeekMs), 0U);
  CHECK(core::fat_time(2000, kWeekMs - 1) != 0U);
  // Days at another second each, from week 2000 (2018-05-06) to 2103; 2100 is no leap year.
  uint16_t year = 2018;
  uint8_t month = 5;
  uint8_t day = 6;
  for (uint16_t number = 0; number < 31000; ++number) {
    const uint32_t second = (number * 7919U) % 86400U;
    uint32_t of_week = (number % 7) * 86400U + second + 18;
    uint16_t week = static_cast<uint16_t>(2000 + number / 7);
    if (of_week >= 604800U) {
      of_week -= 604800U;
      ++week;
    }
    const uint32_t date = (year - 1980U) << 9 | static_cast<uint32_t>(month) << 5 | day;
    const uint32_t time = second / 3600 << 11 | second / 60 % 60 << 5 | second % 60 / 2;
    if (number % 61 == 0 || day == 29 || (month == 3 && day == 1)) {
      CHECK_EQ(core::fat_time(week, of_week * 1000 + number % 1000), date << 16 | time);
    }
    const uint8_t lengths[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    if (++day > lengths[month - 1] + (month == 2 && leap(year) ? 1 : 0)) {
      day = 1;
      month = static_cast<uint8_t>(month % 12 + 1);
      year = static_cast<uint16_t>(year + (month == 1));
    }
  }
  // A receiver of 1999 or 2019 that counts 1024 weeks: one and two rounds later.
  CHECK_EQ(core::fat_time(976, 18000), core::fat_time(2000, 18000));
  CHECK_EQ(core::fat_time(975, 18000), core::fat_time(3023, 18000));
  CHECK_EQ(core::fat_time(1, 20000), core::fat_time(2049, 20000));
  CHECK_EQ(core::fat_time(2000, 17000) >> 16, (38U << 9) | (5U << 5) | 5U);
}
