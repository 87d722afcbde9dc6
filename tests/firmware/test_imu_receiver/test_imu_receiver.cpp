// Packets of both firmwares, whole and damaged.
#include <string.h>

#include "check.h"
#include "core/bytes.h"
#include "core/crc.h"
#include "core/float32.h"
#include "core/imu_receiver.h"
#include "random_numbers.h"

namespace {

using core::ImuResult;

constexpr uint8_t kOwn = frames::kImuPacketAddress;
constexpr uint8_t kFirst = frames::kOriginalImu1PacketAddress;
constexpr uint8_t kSecond = frames::kOriginalImu2PacketAddress;

struct OwnPacket {
  uint8_t bytes[frames::kImuPacketSize];

  explicit OwnPacket(uint8_t seq, uint8_t flags = 0, uint8_t aux_kind = 0) {
    frames::ImuPacket packet = {};
    packet.kind = frames::kImuPacketKind;
    packet.seq = seq;
    packet.flags = flags;
    packet.aux_kind = aux_kind;
    packet.t_us = 5000U * seq;
    packet.age = 300;
    packet.p = 100;
    packet.q = -200;
    packet.r = 300;
    packet.ax = -400;
    packet.ay = 500;
    packet.az = -8192;
    packet.phi = 1000;
    packet.theta = -2000;
    packet.psi = 17999;
    packet.aux[0] = 11;
    packet.aux[1] = 0x0368;  // product 0x68, DLPF_CFG 3
    packet.aux[2] = -13;
    memcpy(bytes, &packet, sizeof(packet));
    seal();
  }
  void seal() { core::put_le(bytes + 34, core::crc16(core::kCrc16Start, bytes, 34)); }
};

struct OriginalPacket {
  uint8_t bytes[32];
  OriginalPacket(const float (&values)[8]) { memcpy(bytes, values, sizeof(bytes)); }
};

const float kFirstValues[8] = {1.25F, -3.5F, 179.99F, 164.0F, -16.4F, 0.6F, -819.2F, 4096.0F};
const float kSecondValues[8] = {8190.33F, 30.05F, 31.25F, 74.5F, 359.5F, 12.34F, 1.0F, 7.0F};

int32_t converted(float value, uint32_t scale, int32_t limit) {
  uint8_t bytes[4];
  memcpy(bytes, &value, 4);
  int32_t out = -999;
  return core::float32_to_int(bytes, scale, limit, out) ? out : -777;
}

}  // namespace

TEST_CASE("a packet of our own firmware, field by field") {
  core::ImuReceiver receiver;
  const OwnPacket packet(7, frames::kImuFlagsAttitudeValid);
  CHECK_EQ(receiver.age_4us(1000), frames::kIdentImuAgeInvalid);
  REQUIRE(receiver.packet(kOwn, packet.bytes, 36, 1000) == ImuResult::kSample);
  const core::ImuSample& sample = receiver.sample();
  CHECK_EQ(sample.seq, 7);
  CHECK(sample.imu_t_us == 35000U);
  CHECK_EQ(sample.p, 100);
  CHECK_EQ(sample.q, -200);
  CHECK_EQ(sample.r, 300);
  CHECK_EQ(sample.ax, -400);
  CHECK_EQ(sample.ay, 500);
  CHECK_EQ(sample.az, -8192);
  CHECK_EQ(sample.phi, 1000);
  CHECK_EQ(sample.theta, -2000);
  CHECK_EQ(sample.psi, 17999);
  CHECK(!sample.original);
  CHECK(sample.unsaturated);
  CHECK_EQ(receiver.good(), 1);
}

TEST_CASE("the age grows with the Mega's clock, over its wrap, and becomes invalid") {
  core::ImuReceiver receiver;
  const OwnPacket packet(1);
  const uint32_t start_us = 0xFFFFFF00U;
  receiver.packet(kOwn, packet.bytes, 36, start_us);
  CHECK_EQ(receiver.age_4us(start_us), 300);
  CHECK_EQ(receiver.age_4us(start_us + 4000), 1300);
  CHECK_EQ(receiver.age_4us(start_us + 260000), 65300);
  CHECK_EQ(receiver.age_4us(start_us + 270000), frames::kIdentImuAgeInvalid);
  CHECK_EQ(receiver.age_4us(start_us + 0x7FFFFFFFU), frames::kIdentImuAgeInvalid);
}

TEST_CASE("saturation of gyro or accelerometer shows") {
  core::ImuReceiver receiver;
  const OwnPacket gyro(1, frames::kImuFlagsGyroSaturated);
  receiver.packet(kOwn, gyro.bytes, 36, 0);
  CHECK(!receiver.sample().unsaturated);
  const OwnPacket accel(2, frames::kImuFlagsAccelSaturated);
  receiver.packet(kOwn, accel.bytes, 36, 5000);
  CHECK(!receiver.sample().unsaturated);
}

TEST_CASE("every flipped bit, every length, every other kind is refused and counted") {
  core::ImuReceiver receiver;
  OwnPacket packet(1);
  uint16_t accepted = 0;
  for (uint16_t bit = 0; bit < 36 * 8; ++bit) {
    packet.bytes[bit / 8] = static_cast<uint8_t>(packet.bytes[bit / 8] ^ 1U << bit % 8);
    accepted = static_cast<uint16_t>(
        accepted + (receiver.packet(kOwn, packet.bytes, 36, 0) != ImuResult::kBad));
    packet.bytes[bit / 8] = static_cast<uint8_t>(packet.bytes[bit / 8] ^ 1U << bit % 8);
  }
  CHECK_EQ(accepted, 0);
  CHECK_EQ(receiver.bad(), 288);
  CHECK(receiver.packet(kOwn, packet.bytes, 35, 0) == ImuResult::kBad);
  CHECK(receiver.packet(kOwn, packet.bytes, 0, 0) == ImuResult::kBad);
  CHECK(receiver.packet(kFirst, packet.bytes, 31, 0) == ImuResult::kBad);
  CHECK(receiver.packet(10, packet.bytes, 36, 0) == ImuResult::kBad);
  packet.bytes[0] = 0xA5;
  packet.seal();
  CHECK(receiver.packet(kOwn, packet.bytes, 36, 0) == ImuResult::kBad);
  CHECK_EQ(receiver.good(), 0);
}

TEST_CASE("gaps and duplicates are counted exactly, over the wrap of the sequence") {
  core::ImuReceiver receiver;
  const uint8_t sent[] = {253, 254, 254, 1, 2, 2, 2, 9};  // 255 and 0, 3 to 8 are missing
  uint32_t start_us = 0;
  uint8_t duplicates = 0;
  for (const uint8_t seq : sent) {
    const OwnPacket packet(seq);
    if (receiver.packet(kOwn, packet.bytes, 36, start_us) == ImuResult::kDuplicate) ++duplicates;
    start_us += 5000;
  }
  CHECK_EQ(receiver.good(), 5);
  CHECK_EQ(duplicates, 3);
  CHECK_EQ(receiver.lost(), 8);
}

TEST_CASE("a number that comes again with another sample is no gap of 255") {
  core::ImuReceiver receiver;
  OwnPacket packet(40);
  receiver.packet(kOwn, packet.bytes, 36, 0);
  packet.bytes[4] ^= 1;  // t_us
  packet.seal();
  CHECK(receiver.packet(kOwn, packet.bytes, 36, 5000) == ImuResult::kSample);
  CHECK_EQ(receiver.lost(), 0);
  CHECK_EQ(receiver.good(), 2);
}

TEST_CASE("behind a second of silence the sequence says nothing about losses") {
  core::ImuReceiver receiver;
  const OwnPacket before(10);
  const OwnPacket soon(30);
  const OwnPacket late(90);
  receiver.packet(kOwn, before.bytes, 36, 0);
  receiver.packet(kOwn, soon.bytes, 36, 100000);
  CHECK_EQ(receiver.lost(), 19);
  receiver.packet(kOwn, late.bytes, 36, 1200000);
  CHECK_EQ(receiver.lost(), 19);
}

TEST_CASE("a restarted IMU is told once and is no gap") {
  core::ImuReceiver receiver;
  const OwnPacket before(200);
  receiver.packet(kOwn, before.bytes, 36, 0);
  CHECK(!receiver.take_restarted());
  const OwnPacket first(0, frames::kImuFlagsRestarted);
  const OwnPacket second(1, frames::kImuFlagsRestarted);
  receiver.packet(kOwn, first.bytes, 36, 5000);
  receiver.packet(kOwn, second.bytes, 36, 10000);
  CHECK(receiver.take_restarted());
  CHECK(!receiver.take_restarted());
  CHECK_EQ(receiver.lost(), 0);
}

TEST_CASE("what aux carries goes to its frame") {
  core::ImuReceiver receiver;
  frames::MagFrame mag = {};
  frames::AttitudeFrame attitude = {};
  CHECK(!receiver.take_mag(mag));
  CHECK(!receiver.take_attitude(attitude));
  const OwnPacket no_field(0, 0, 0);
  receiver.packet(kOwn, no_field.bytes, 36, 0);
  CHECK(!receiver.take_mag(mag));
  const OwnPacket field(1, frames::kImuFlagsMagValid, 0);
  receiver.packet(kOwn, field.bytes, 36, 5000);
  REQUIRE(receiver.take_mag(mag));
  CHECK(!receiver.take_mag(mag));
  CHECK_EQ(mag.mx, 11);
  CHECK_EQ(mag.mz, -13);
  const OwnPacket bias(2, 0, 1);
  const OwnPacket status(3, 0, 2);
  receiver.packet(kOwn, bias.bytes, 36, 10000);
  receiver.packet(kOwn, status.bytes, 36, 15000);
  REQUIRE(receiver.take_attitude(attitude));
  CHECK(!receiver.take_attitude(attitude));
  CHECK_EQ(attitude.bias_p, 11);
  CHECK_EQ(attitude.bias_r, -13);
  CHECK_EQ(attitude.temperature, 11);
  CHECK_EQ(attitude.product_id, 0x68);
  CHECK_EQ(attitude.dlpf, 3);
  CHECK_EQ(attitude.imu_seq, 3);
  CHECK_EQ(receiver.dlpf(), 3);
}

TEST_CASE("two original packets make one sample at the time of the first") {
  core::ImuReceiver receiver;
  const OriginalPacket first(kFirstValues);
  const OriginalPacket second(kSecondValues);
  CHECK(receiver.packet(kFirst, first.bytes, 32, 1000) == ImuResult::kHalf);
  REQUIRE(receiver.packet(kSecond, second.bytes, 32, 4200) == ImuResult::kSample);
  const core::ImuSample& sample = receiver.sample();
  CHECK(sample.original);
  CHECK(sample.start_us == 1000U);
  CHECK_EQ(sample.phi, 125);
  CHECK_EQ(sample.theta, -350);
  CHECK_EQ(sample.psi, 17999);
  CHECK_EQ(sample.p, 164);
  CHECK_EQ(sample.q, -16);
  CHECK_EQ(sample.r, 1);
  CHECK_EQ(sample.ax, -819);
  CHECK_EQ(sample.ay, 4096);
  CHECK_EQ(sample.az, 8190);
  CHECK_EQ(sample.flags, frames::kImuFlagsAttitudeValid);
  CHECK(sample.unsaturated);
  const uint8_t seq = sample.seq;
  receiver.packet(kFirst, first.bytes, 32, 21000);
  receiver.packet(kSecond, second.bytes, 32, 24000);
  CHECK_EQ(receiver.sample().seq, static_cast<uint8_t>(seq + 1));
}

TEST_CASE("original halves that do not belong together make no sample") {
  core::ImuReceiver receiver;
  const OriginalPacket first(kFirstValues);
  const OriginalPacket second(kSecondValues);
  CHECK(receiver.packet(kSecond, second.bytes, 32, 0) == ImuResult::kHalf);
  receiver.packet(kFirst, first.bytes, 32, 1000);
  CHECK(receiver.packet(kSecond, second.bytes, 32, 20000) == ImuResult::kHalf);
  CHECK_EQ(receiver.good(), 0);
  CHECK_EQ(receiver.lost(), 2);
}

TEST_CASE("NaN, infinity and what no gyro measures are invalid") {
  core::ImuReceiver receiver;
  OriginalPacket first(kFirstValues);
  const OriginalPacket second(kSecondValues);
  core::put_le(first.bytes, 0x7FC00000U);       // roll: NaN
  core::put_le(first.bytes + 12, 0xFF800000U);  // gyro x: -infinity
  core::put_le(first.bytes + 16, 0x47800000U);  // gyro y: 65536
  receiver.packet(kFirst, first.bytes, 32, 0);
  receiver.packet(kSecond, second.bytes, 32, 3000);
  CHECK_EQ(receiver.sample().phi, INT16_MIN);
  CHECK_EQ(receiver.sample().p, INT16_MIN);
  CHECK_EQ(receiver.sample().q, INT16_MIN);
  CHECK_EQ(receiver.sample().r, 1);
  CHECK_EQ(receiver.sample().flags, 0);
  CHECK(!receiver.sample().unsaturated);
}

TEST_CASE("the position of the second original packet") {
  core::ImuReceiver receiver;
  frames::GpsFrame gps;
  CHECK(!receiver.take_position(gps));
  OriginalPacket second(kSecondValues);
  receiver.packet(kSecond, second.bytes, 32, 77);
  REQUIRE(receiver.take_position(gps));
  CHECK(!receiver.take_position(gps));
  const int32_t latitude = gps.latitude;
  const int32_t longitude = gps.longitude;
  const int32_t height = gps.height;
  const uint32_t itow_ms = gps.itow_ms;
  CHECK(latitude > 300499980);
  CHECK(latitude < 300500020);
  CHECK(longitude == 312500000);
  CHECK(height == 74500);
  CHECK(itow_ms == frames::kGpsItowMsInvalid);
  CHECK_EQ(gps.course, 35950);
  CHECK_EQ(gps.ground_speed, 1234);
  CHECK_EQ(gps.satellites, 7);
  CHECK_EQ(gps.fix, 3);
  CHECK_EQ(gps.source, 2);
  core::put_le(second.bytes + 24, uint32_t{0});  // no fix
  receiver.packet(kSecond, second.bytes, 32, 99);
  REQUIRE(receiver.take_position(gps));
  const int32_t none = gps.latitude;
  CHECK(none == frames::kGpsLatitudeInvalid);
  CHECK_EQ(gps.fix, 0);
}

TEST_CASE("single precision to integers, without floating point, rounds as the PC does") {
  CHECK(converted(0.0F, 100, 1000) == 0);
  CHECK(converted(-0.0F, 100, 1000) == 0);
  CHECK(converted(1e-30F, 100, 1000) == 0);
  CHECK(converted(0.005F, 100, 1000) == 0);  // 0.49999999 after rounding to single precision
  CHECK(converted(0.25F, 2, 1000) == 1);     // half away from zero
  CHECK(converted(-0.25F, 2, 1000) == -1);
  CHECK(converted(32767.0F, 1, 32767) == 32767);
  CHECK(converted(32767.6F, 1, 32767) == -777);
  CHECK(converted(1e9F, 1, 2000000000) == 1000000000);
  CHECK(converted(3e38F, 1, 2000000000) == -777);
  CHECK(converted(179.5F, 10000000, 1800000000) == 1795000000);
  CHECK(converted(-180.5F, 10000000, 1800000000) == -777);
}

TEST_CASE("random bytes as packets never pass for good ones") {
  core::ImuReceiver receiver;
  uint32_t random = 8;
  for (uint16_t round = 0; round < 500; ++round) {
    uint8_t bytes[36];
    for (uint8_t& byte : bytes) {
      next_random(random);
      byte = static_cast<uint8_t>(random >> 24);
    }
    bytes[0] = frames::kImuPacketKind;
    receiver.packet(kOwn, bytes, static_cast<uint8_t>(random >> 16) % 37, round);
    receiver.packet(round % 2 == 0 ? kFirst : kSecond, bytes, 32, round);
  }
  frames::GpsFrame gps;
  CHECK(receiver.take_position(gps));
  CHECK(receiver.bad() >= 499);
}
