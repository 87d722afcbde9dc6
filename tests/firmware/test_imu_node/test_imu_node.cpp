// Samples in, packets out, read back by the Mega's own receiver; offsets and their refusals.
#include <string.h>

#include "check.h"
#include "core/bytes.h"
#include "core/imu/console.h"
#include "core/imu/node.h"
#include "core/imu_receiver.h"
#include "random_numbers.h"

namespace {

using core::ImuResult;

constexpr uint32_t kPeriodUs = 5000;

struct Imu {
  core::ImuSettings settings;
  core::ImuNode node;
  core::ImuRawSample raw = {};
  uint32_t t_us = 0xFFFFF000U;
  uint8_t bytes[frames::kImuPacketSize];

  Imu() : settings(defaults()), node(settings) {
    raw.force[2] = -8192;
    raw.temperature_cdegc = 3125;
  }
  static core::ImuSettings defaults() {
    core::ImuSettings out;
    core::default_imu_settings(out);
    return out;
  }
  void run(uint16_t samples) {
    for (uint16_t i = 0; i < samples; ++i) {
      t_us += kPeriodUs;
      node.sample(raw, t_us);
      node.catch_up();
    }
  }
  frames::GpsFrame fix(uint16_t speed_cmps) {
    frames::GpsFrame gps = {};
    gps.fix = static_cast<uint8_t>(frames::GpsFix::kFix3d);
    gps.ground_speed = speed_cmps;
    gps.latitude = 300512345;
    gps.longitude = -312345678;
    gps.height = 74500;
    gps.course = 35950;
    gps.satellites = 9;
    node.set_gps(gps);
    return gps;
  }
};

float number(const uint8_t* bytes, uint8_t index) {
  float value = 0;
  memcpy(&value, bytes + 4 * index, 4);
  return value;
}

bool near(float value, float truth, float share) {
  const float gap = value > truth ? value - truth : truth - value;
  return gap <= share * (truth < 0 ? -truth : truth);
}

}  // namespace

TEST_CASE("the Mega's receiver reads back every packet: values, age, sequence, what aux holds") {
  Imu imu;
  imu.node.set_chip(0x55, 3);
  imu.node.count_reset(7);
  core::ImuReceiver mega;
  imu.raw.rates[0] = 655;
  imu.raw.rates[1] = -32767;
  imu.raw.force[0] = 123;
  imu.raw.gyro_saturated = true;
  for (uint8_t i = 0; i < 20; ++i) {
    imu.run(1);
    if (i == 5) {
      const int16_t field[3] = {100, -200, 300};
      imu.node.set_field(field);
    }
    imu.node.put_packet(imu.bytes, imu.t_us + 1234);
    REQUIRE(mega.packet(frames::kImuPacketAddress, imu.bytes, 36, 1000U + 5000U * i) ==
            ImuResult::kSample);
    frames::MagFrame mag;
    CHECK_EQ(mega.take_mag(mag), i == 5);
    if (i == 5) {
      CHECK_EQ(mag.my, -200);
    }
  }
  CHECK_EQ(mega.lost(), 0);
  CHECK_EQ(mega.sample().p, 655);
  CHECK_EQ(mega.sample().q, -32767);
  CHECK_EQ(mega.sample().ax, 123);
  CHECK_EQ(mega.sample().az, -8192);
  CHECK_EQ(mega.sample().age_4us, 309);  // 1234 us, to the nearest 4
  CHECK(mega.sample().imu_t_us == imu.t_us);
  CHECK(!mega.sample().unsaturated);
  frames::AttitudeFrame attitude;
  REQUIRE(mega.take_attitude(attitude));
  CHECK_EQ(attitude.product_id, 0x55);
  CHECK_EQ(attitude.dlpf, 3);
  CHECK_EQ(attitude.temperature, 3125);
  CHECK(int16_t{attitude.bias_p} != INT16_MIN);
  CHECK((attitude.imu_flags & frames::kImuFlagsRestarted) != 0);
  CHECK((attitude.imu_flags & frames::kImuFlagsGyroSaturated) != 0);
}

TEST_CASE("a sample that never came leaves a gap of one; the flag of a restart ends") {
  Imu imu;
  core::ImuReceiver mega;
  imu.run(1);
  imu.node.put_packet(imu.bytes, imu.t_us);
  mega.packet(frames::kImuPacketAddress, imu.bytes, 36, 1000);
  imu.node.skip();
  imu.run(1);
  imu.node.put_packet(imu.bytes, imu.t_us);
  mega.packet(frames::kImuPacketAddress, imu.bytes, 36, 11000);
  CHECK_EQ(mega.lost(), 1);
  CHECK((imu.node.flags() & frames::kImuFlagsRestarted) != 0);
  imu.run(core::ImuNode::kRestartedSamples);
  CHECK((imu.node.flags() & frames::kImuFlagsRestarted) == 0);
}

TEST_CASE("rates are zeroed at rest, never in motion, never while a GPS says it moves") {
  Imu imu;
  imu.raw.rates[0] = 40;
  imu.raw.rates[2] = -500;
  imu.run(399);
  CHECK(!imu.node.zero_rates());
  CHECK_EQ(imu.settings.rate_offset[2], 0);
  imu.run(1);
  imu.fix(800);
  CHECK(!imu.node.zero_rates());
  imu.fix(50);
  REQUIRE(imu.node.zero_rates());
  CHECK_EQ(imu.settings.rate_offset[0], 40);
  CHECK_EQ(imu.settings.rate_offset[2], -500);
  CHECK_EQ(imu.settings.offsets_cdegc, 3125);
  imu.run(1);
  imu.node.put_packet(imu.bytes, imu.t_us);
  frames::ImuPacket packet;
  memcpy(&packet, imu.bytes, sizeof(packet));
  CHECK_EQ(int16_t{packet.p}, 0);
  CHECK_EQ(int16_t{packet.r}, 0);
  CHECK((packet.flags & frames::kImuFlagsOffsetsValid) != 0);
  // In the air: the turn that followed must not become the zero.
  for (uint16_t i = 0; i < 1000; ++i) {
    imu.raw.rates[2] = static_cast<int16_t>(i % 40 * 20);
    imu.run(1);
  }
  CHECK(!imu.node.zero_rates());
  CHECK(!imu.node.level());
  CHECK_EQ(imu.settings.rate_offset[2], -500);
}

TEST_CASE("offsets survive a reset through the record, and a damaged record gives none") {
  Imu imu;
  imu.raw.rates[1] = 77;
  imu.raw.force[0] = 300;
  imu.raw.force[2] = -8100;
  imu.run(400);
  REQUIRE(imu.node.zero_rates());
  REQUIRE(imu.node.level());
  CHECK_EQ(imu.settings.force_offset[0], 300);
  CHECK_EQ(imu.settings.force_offset[2], 92);
  uint8_t record[core::kImuRecordSize];
  core::write_imu_record(record, imu.settings);
  core::ImuSettings again;
  REQUIRE(core::read_imu_record(record, again));
  CHECK_EQ(memcmp(&again, &imu.settings, sizeof(again)), 0);
  for (uint8_t at = 0; at < core::kImuRecordSize; ++at) {
    record[at] = static_cast<uint8_t>(record[at] ^ 0x20);
    CHECK(!core::read_imu_record(record, again));
    CHECK_EQ(again.offsets_valid, 0);
    CHECK_EQ(int16_t{again.rate_offset[1]}, 0);
    record[at] = static_cast<uint8_t>(record[at] ^ 0x20);
  }
  memset(record, 0xFF, sizeof(record));  // a new chip
  CHECK(!core::read_imu_record(record, again));
  imu.settings.rate_offset[0] = 2000;  // whole, but no gyro is off by 30 deg/s
  core::write_imu_record(record, imu.settings);
  CHECK(!core::read_imu_record(record, again));
}

TEST_CASE("the bias learned at rest is that of whole seconds: the start of a motion is not in it") {
  Imu imu;
  imu.settings.rate_offset[1] = 10;
  imu.raw.rates[1] = 40;
  imu.run(600);
  CHECK((imu.node.attitude().bias(1) >= 29 && imu.node.attitude().bias(1) <= 30));
  for (uint16_t i = 0; i < 600; ++i) {  // the slowest begin: 2 deg/s within a second, then more
    imu.raw.rates[1] = static_cast<int16_t>(40 + i * 13 / 20);
    imu.raw.force[0] = static_cast<int16_t>(i * 2);
    imu.run(1);
  }
  CHECK((imu.node.attitude().bias(1) >= 27 && imu.node.attitude().bias(1) <= 33));
}

TEST_CASE("a parking attitude far from level is refused as level") {
  Imu imu;
  imu.raw.force[0] = 2500;  // 18 deg of pitch
  imu.raw.force[2] = -7800;
  imu.run(400);
  REQUIRE(imu.node.at_rest());
  CHECK(!imu.node.level());
  CHECK_EQ(imu.settings.force_offset[0], 0);
}

TEST_CASE("compat: the Mega's receiver reads the two original packets with their old meaning") {
  Imu imu;
  imu.settings.compat = 1;
  imu.run(700);
  imu.raw.rates[0] = 6550;  // 100 deg/s: 1640 counts of 16.4
  imu.raw.rates[1] = -6550;
  imu.raw.force[1] = -4096;
  uint8_t due = 0;
  for (uint8_t i = 0; i < 8; ++i) {
    imu.run(1);
    due = static_cast<uint8_t>(due + (imu.node.compat_due() ? 1 : 0));
  }
  CHECK_EQ(due, 2);
  const frames::GpsFrame gps = imu.fix(1234);
  uint8_t first[32], second[32];
  imu.node.put_compat(first, second);
  CHECK(near(number(first, 3), 1640.0F, 1e-4F));
  CHECK(near(number(first, 4), -1640.0F, 1e-4F));
  CHECK(number(first, 7) == 4096.0F);
  CHECK(number(second, 0) == 8192.0F);
  CHECK(near(number(second, 1), 30.0512345F, 1e-6F));
  CHECK(near(number(second, 2), -31.2345678F, 1e-6F));
  CHECK(near(number(second, 3), 74.5F, 1e-4F));
  CHECK(near(number(second, 4), 359.5F, 1e-5F));
  CHECK(near(number(second, 5), 12.34F, 1e-5F));
  CHECK(number(second, 6) == 1.0F);
  CHECK(number(second, 7) == 9.0F);
  core::ImuReceiver mega;
  CHECK(mega.packet(frames::kOriginalImu1PacketAddress, first, 32, 1000) == ImuResult::kHalf);
  REQUIRE(mega.packet(frames::kOriginalImu2PacketAddress, second, 32, 2000) == ImuResult::kSample);
  CHECK_EQ(mega.sample().p, 1640);
  CHECK_EQ(mega.sample().az, 8192);
  CHECK_EQ(mega.sample().phi, imu.node.attitude().phi_cdeg());
  frames::GpsFrame position;
  REQUIRE(mega.take_position(position));
  CHECK(int32_t{position.latitude} > gps.latitude - 20);
  CHECK(int32_t{position.latitude} < gps.latitude + 20);
  CHECK_EQ(position.satellites, 9);
}

TEST_CASE("single precision from integers: powers of two, signs, ends") {
  struct Case {
    int32_t value;
    uint8_t bits;
    float truth;
  };
  const Case cases[] = {{1, 0, 1.0F},
                        {-3, 1, -1.5F},
                        {0, 5, 0.0F},
                        {INT32_MAX, 31, 1.0F},
                        {INT32_MIN, 0, -2147483648.0F},
                        {16777215, 24, 0.99999994F}};
  for (const Case& each : cases) {
    uint8_t bytes[4];
    core::put_le(bytes, core::float32_bits(each.value, each.bits));
    CHECK((number(bytes, 0) == each.truth || near(number(bytes, 0), each.truth, 1.2e-7F)));
  }
}

namespace {

core::ImuReply say(core::ImuConsole& console, Imu& imu, const char* text) {
  core::ImuReply reply = core::ImuReply::kNone;
  for (; *text != 0; ++text) {
    reply = console.byte(static_cast<uint8_t>(*text), imu.node, imu.settings);
  }
  return reply;
}

}  // namespace

TEST_CASE("the console changes settings at rest only, and refuses what it does not know") {
  using core::ImuReply;
  core::ImuConsole console;
  Imu imu;
  CHECK(say(console, imu, "imu declination -413\n") == ImuReply::kMoving);
  CHECK(say(console, imu, "imu zero\n") == ImuReply::kMoving);
  CHECK(say(console, imu, "imu show\n") == ImuReply::kShow);
  imu.run(400);
  CHECK(say(console, imu, "imu declination -413\r") == ImuReply::kChanged);
  CHECK_EQ(int16_t{imu.settings.declination_cdeg}, -413);
  CHECK(say(console, imu, "imu dlpf 3\n") == ImuReply::kChanged);
  CHECK(say(console, imu, "imu compat 1\n") == ImuReply::kChanged);
  CHECK(say(console, imu, "imu zero\n") == ImuReply::kChanged);
  CHECK_EQ(imu.settings.dlpf, 3);
  CHECK_EQ(imu.settings.compat, 1);
  CHECK_EQ(imu.settings.offsets_valid, 1);
  CHECK(say(console, imu, "imu iron -2048 -2047 -2046\n") == ImuReply::kChanged);
  CHECK(say(console, imu, "imu iron 120 -45 0\n") == ImuReply::kChanged);
  CHECK_EQ(int16_t{imu.settings.field_offset[0]}, 120);
  CHECK_EQ(int16_t{imu.settings.field_offset[1]}, -45);
  CHECK_EQ(int16_t{imu.settings.field_offset[2]}, 0);
  imu.settings.compat = 0;
  imu.node.set_field({300, -200, 100});
  frames::ImuPacket packet;
  imu.node.put_packet(imu.bytes, imu.t_us);
  memcpy(&packet, imu.bytes, sizeof(packet));
  CHECK_EQ(int16_t{packet.aux[0]}, 180);
  CHECK_EQ(int16_t{packet.aux[1]}, -155);
  CHECK_EQ(int16_t{packet.aux[2]}, 100);
  const char* const refused[] = {"imu iron 1 2\n",
                                 "imu iron 1 2 3 4\n",
                                 "imu iron 1  3\n",
                                 "imu iron 1 2 2049\n",
                                 "imu iron 1 2 \n",
                                 "imu iron\n",
                                 "imu dlpf 3 3\n",
                                 "imu dlpf 7\n",
                                 "imu dlpf\n",
                                 "imu compat 2\n",
                                 "imu dlpf 2x\n",
                                 "imu declination 99999999\n",
                                 "imu declination 18001\n",
                                 "imu zeros\n",
                                 "imu \n"};
  for (const char* const text : refused) {
    CHECK(say(console, imu, text) != ImuReply::kChanged);
  }
  CHECK(say(console, imu, "imu dlpf 7\n") == ImuReply::kUnknown);
  CHECK_EQ(imu.settings.dlpf, 3);
  CHECK_EQ(int16_t{imu.settings.field_offset[0]}, 120);
  // The stream of a GPS receiver, line ends included, is not for it.
  uint32_t random = 7;
  for (uint16_t i = 0; i < 5000; ++i) {
    next_random(random);
    CHECK(console.byte(static_cast<uint8_t>(random >> 24), imu.node, imu.settings) ==
          ImuReply::kNone);
  }
}
