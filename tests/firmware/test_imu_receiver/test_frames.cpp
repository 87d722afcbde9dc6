// Every field of what the receiver gives out, and its limits to the step.
#include <string.h>

#include "check.h"
#include "core/bytes.h"
#include "core/crc.h"
#include "core/imu_receiver.h"

namespace {

using core::ImuReceiver;
using core::ImuResult;

constexpr uint8_t kOwn = frames::kImuPacketAddress;
constexpr uint8_t kFirst = frames::kOriginalImu1PacketAddress;
constexpr uint8_t kSecond = frames::kOriginalImu2PacketAddress;

ImuResult send(ImuReceiver& receiver,
               uint8_t seq,
               uint32_t t_us,
               uint32_t start_us,
               uint8_t aux_kind = 0,
               uint8_t flags = 0) {
  frames::ImuPacket packet = {};
  packet.kind = frames::kImuPacketKind;
  packet.seq = seq;
  packet.flags = flags;
  packet.t_us = t_us;
  packet.aux_kind = aux_kind;
  packet.aux[0] = 101;
  packet.aux[1] = 0x0268;
  packet.aux[2] = 303;
  uint8_t bytes[frames::kImuPacketSize];
  memcpy(bytes, &packet, sizeof bytes);
  core::put_le(bytes + 34, core::crc16(core::kCrc16Start, bytes, 34));
  return receiver.packet(kOwn, bytes, sizeof bytes, start_us);
}

ImuResult send_original(ImuReceiver& receiver,
                        uint8_t address,
                        const float (&values)[8],
                        uint32_t start_us) {
  uint8_t bytes[32];
  memcpy(bytes, values, sizeof bytes);
  return receiver.packet(address, bytes, sizeof bytes, start_us);
}

const float kCalm[8] = {1.0F, 2.0F, 3.0F, 4.0F, 5.0F, 6.0F, 7.0F, 8.0F};
const float kPlace[8] = {9.0F, 30.0F, -120.0F, 74.5F, 359.5F, 12.0F, 1.0F, 7.0F};

}  // namespace

TEST_CASE("each field of the frames `mag` and `attitude` is its own") {
  ImuReceiver receiver;
  frames::MagFrame mag;
  frames::AttitudeFrame attitude;
  send(receiver, 1, 5000, 900, static_cast<uint8_t>(frames::ImuAux::kGyroBias));
  REQUIRE(receiver.take_attitude(attitude));
  CHECK_EQ(attitude.bias_p, 101);
  CHECK_EQ(attitude.bias_q, 0x0268);
  CHECK_EQ(attitude.bias_r, 303);
  send(receiver, 2, 10000, 5900, static_cast<uint8_t>(frames::ImuAux::kStatus), 0x40);
  REQUIRE(receiver.take_attitude(attitude));
  CHECK_EQ(attitude.t_us, 5900U);
  CHECK_EQ(attitude.imu_t_us, 10000U);
  CHECK_EQ(attitude.imu_seq, 2);
  CHECK_EQ(attitude.imu_flags, 0x40);
  CHECK_EQ(attitude.temperature, 101);
  CHECK_EQ(attitude.product_id, 0x68);
  CHECK_EQ(attitude.dlpf, 2);
  CHECK_EQ(receiver.dlpf(), 2);
  CHECK_EQ(attitude.bias_q, 0x0268);
  CHECK(!receiver.take_mag(mag));
  send(receiver, 3, 15000, 10900, 0, frames::kImuFlagsMagValid);
  REQUIRE(receiver.take_mag(mag));
  CHECK_EQ(mag.t_us, 10900U);
  CHECK_EQ(mag.mx, 101);
  CHECK_EQ(mag.my, 0x0268);
  CHECK_EQ(mag.mz, 303);
}

TEST_CASE("an original packet of another length is bad, whichever it is") {
  const uint8_t addresses[] = {kFirst, kSecond};
  uint8_t bytes[40] = {};
  for (const uint8_t address : addresses) {
    ImuReceiver receiver;
    CHECK(receiver.packet(address, bytes, 31, 0) == ImuResult::kBad);
    CHECK(receiver.packet(address, bytes, 33, 0) == ImuResult::kBad);
    CHECK_EQ(receiver.bad(), 2);
    CHECK_EQ(receiver.lost(), 0);
  }
  ImuReceiver receiver;
  CHECK(receiver.packet(99, bytes, 32, 0) == ImuResult::kBad);
  CHECK(receiver.packet(0, bytes, 32, 0) == ImuResult::kBad);
}

TEST_CASE("our own packet behind original ones is no gap and no longer original") {
  ImuReceiver receiver;
  send_original(receiver, kFirst, kCalm, 1000);
  REQUIRE(send_original(receiver, kSecond, kPlace, 2000) == ImuResult::kSample);
  CHECK(receiver.sample().original);
  CHECK(receiver.sample().imu_t_us == 0U);
  CHECK_EQ(receiver.sample().age_4us, 0);
  CHECK_EQ(receiver.age_4us(1000), 0);
  REQUIRE(send(receiver, 77, 400, 3000) == ImuResult::kSample);
  CHECK(!receiver.sample().original);
  CHECK_EQ(receiver.lost(), 0);
  REQUIRE(send(receiver, 79, 800, 4000) == ImuResult::kSample);
  CHECK_EQ(receiver.lost(), 1);
}

TEST_CASE("only number and time together make a duplicate") {
  ImuReceiver receiver;
  send(receiver, 10, 5000, 1000);
  CHECK(send(receiver, 10, 5000, 2000) == ImuResult::kDuplicate);
  CHECK(send(receiver, 11, 5000, 3000) == ImuResult::kSample);
  CHECK(send(receiver, 10, 5000, 4000) == ImuResult::kSample);
  CHECK(send(receiver, 10, 5001, 5000) == ImuResult::kSample);
}

TEST_CASE("losses are counted up to a second of silence, to the microsecond") {
  ImuReceiver receiver;
  send(receiver, 1, 1, 0);
  send(receiver, 3, 2, ImuReceiver::kSilentUs - 1);
  CHECK_EQ(receiver.lost(), 1);
  send(receiver, 5, 3, 2 * ImuReceiver::kSilentUs - 1);
  CHECK_EQ(receiver.lost(), 1);
}

TEST_CASE("an age is known for 262 ms, to the step") {
  ImuReceiver receiver;
  send(receiver, 1, 1, 0);
  CHECK_EQ(receiver.age_4us(4UL * 65534UL), 65534U);
  CHECK_EQ(receiver.age_4us(4UL * 65535UL), frames::kIdentImuAgeInvalid);
  CHECK_EQ(receiver.age_4us(4UL * 65536UL), frames::kIdentImuAgeInvalid);
  CHECK_EQ(receiver.age_4us(4UL * 65540UL), frames::kIdentImuAgeInvalid);
}

TEST_CASE("a second original packet without its first is one loss each time") {
  ImuReceiver receiver;
  send_original(receiver, kFirst, kCalm, 0);
  CHECK(send_original(receiver, kSecond, kPlace, ImuReceiver::kPairUs + 1) == ImuResult::kHalf);
  CHECK_EQ(receiver.lost(), 1);
  send_original(receiver, kFirst, kCalm, 20000);
  CHECK_EQ(receiver.lost(), 1);
  CHECK(send_original(receiver, kSecond, kPlace, 20000 + ImuReceiver::kPairUs) ==
        ImuResult::kSample);
  CHECK_EQ(receiver.lost(), 1);
  CHECK(send_original(receiver, kSecond, kPlace, 40000) == ImuResult::kHalf);
  CHECK_EQ(receiver.lost(), 2);
}

TEST_CASE("each original channel at its end is saturation") {
  const uint8_t places[] = {3, 4, 5, 6, 7};
  for (const uint8_t place : places) {
    for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
      ImuReceiver receiver;
      float values[8];
      memcpy(values, kCalm, sizeof values);
      values[place] = static_cast<float>(sign) * 32767.0F;
      send_original(receiver, kFirst, values, 0);
      REQUIRE(send_original(receiver, kSecond, kPlace, 100) == ImuResult::kSample);
      CHECK(!receiver.sample().unsaturated);
    }
  }
  ImuReceiver receiver;
  send_original(receiver, kFirst, kCalm, 0);
  send_original(receiver, kSecond, kPlace, 100);
  CHECK(receiver.sample().unsaturated);
}

TEST_CASE("west longitudes and south latitudes are places too") {
  ImuReceiver receiver;
  frames::GpsFrame out = {};
  const float south[8] = {9.0F, -45.5F, -120.25F, -3.0F, 0.0F, 0.0F, 1.0F, 0.0F};
  send_original(receiver, kSecond, south, 700);
  REQUIRE(receiver.take_position(out));
  CHECK_EQ(out.t_us, 700U);
  CHECK_EQ(out.latitude, -455000000);
  CHECK_EQ(out.longitude, -1202500000);
  CHECK_EQ(out.height, -3000);
  CHECK_EQ(out.course, 0);
  CHECK_EQ(out.ground_speed, 0);
  CHECK_EQ(out.satellites, 0);
  CHECK(!receiver.take_position(out));
}

TEST_CASE("an original attitude counts only with all three angles; each pair is one good sample") {
  for (uint8_t place = 0; place < 3; ++place) {
    ImuReceiver receiver;
    float values[8];
    memcpy(values, kCalm, sizeof values);
    values[place] = 1000.0F;
    send_original(receiver, kFirst, values, 0);
    REQUIRE(send_original(receiver, kSecond, kPlace, 100) == ImuResult::kSample);
    CHECK_EQ(receiver.sample().flags, 0);
    CHECK_EQ(receiver.good(), 1);
  }
}

TEST_CASE("an auxiliary value of an unknown kind goes nowhere") {
  ImuReceiver receiver;
  frames::AttitudeFrame attitude;
  send(receiver, 1, 5000, 900, 3, frames::kImuFlagsMagValid);
  REQUIRE(receiver.take_attitude(attitude));
  CHECK_EQ(attitude.temperature, INT16_MIN);
  CHECK_EQ(attitude.bias_p, INT16_MIN);
  frames::MagFrame mag;
  CHECK(!receiver.take_mag(mag));
}

TEST_CASE("a restart is told at its first packet alone, though the flag stays") {
  ImuReceiver receiver;
  send(receiver, 200, 5000, 900);
  send(receiver, 0, 100, 5900, 0, frames::kImuFlagsRestarted);
  CHECK(receiver.take_restarted());
  send(receiver, 1, 5100, 10900, 0, frames::kImuFlagsRestarted);
  CHECK(!receiver.take_restarted());
}

TEST_CASE("losses are counted from the last packet on, late in a flight too") {
  ImuReceiver receiver;
  send(receiver, 1, 1, 3000000000U);
  send(receiver, 3, 2, 3000005000U);
  CHECK_EQ(receiver.lost(), 1);
}

TEST_CASE("course, speed and satellites below zero are none, and so is a fix that is no number") {
  ImuReceiver receiver;
  frames::GpsFrame out = {};
  const float below[8] = {9.0F, 1.0F, 1.0F, 1.0F, -0.05F, -0.05F, 1.0F, -5.0F};
  send_original(receiver, kSecond, below, 700);
  REQUIRE(receiver.take_position(out));
  CHECK_EQ(out.course, frames::kGpsCourseInvalid);
  CHECK_EQ(out.ground_speed, frames::kGpsGroundSpeedInvalid);
  CHECK_EQ(out.satellites, 0);
  const float beyond[8] = {9.0F, 1.0F, 181.0F, 1.0F, 361.0F, 700.0F, 256.0F, 7.0F};
  send_original(receiver, kSecond, beyond, 800);
  REQUIRE(receiver.take_position(out));
  CHECK_EQ(out.fix, 0);
  const float far[8] = {9.0F, 91.0F, 181.0F, 1e6F, 361.0F, 700.0F, 1.0F, 256.0F};
  send_original(receiver, kSecond, far, 900);
  REQUIRE(receiver.take_position(out));
  const int32_t latitude = out.latitude;
  const int32_t longitude = out.longitude;
  CHECK(latitude == frames::kGpsLatitudeInvalid);
  CHECK(longitude == frames::kGpsLongitudeInvalid);
  CHECK_EQ(out.course, frames::kGpsCourseInvalid);
  CHECK_EQ(out.ground_speed, frames::kGpsGroundSpeedInvalid);
  CHECK_EQ(out.satellites, 0);
}

TEST_CASE("a course is known up to 360 degrees, to the hundredth") {
  const float courses[] = {360.0F, 360.01F};
  const uint16_t told[] = {36000, frames::kGpsCourseInvalid};
  for (uint8_t i = 0; i < 2; ++i) {
    ImuReceiver receiver;
    frames::GpsFrame out = {};
    const float values[8] = {9.0F, 1.0F, 1.0F, 1.0F, courses[i], 1.0F, 1.0F, 7.0F};
    send_original(receiver, kSecond, values, 700);
    REQUIRE(receiver.take_position(out));
    CHECK_EQ(out.course, told[i]);
  }
}

TEST_CASE("each original half counts once: twice the first is a loss, twice the second too") {
  ImuReceiver receiver;
  send_original(receiver, kFirst, kCalm, 0);
  CHECK(send_original(receiver, kSecond, kPlace, 1000) == ImuResult::kSample);
  CHECK(send_original(receiver, kSecond, kPlace, 1500) == ImuResult::kHalf);
  CHECK_EQ(receiver.good(), 1);
  CHECK_EQ(receiver.lost(), 1);
  send_original(receiver, kFirst, kCalm, 20000);
  CHECK_EQ(receiver.lost(), 1);
  send_original(receiver, kFirst, kCalm, 21000);
  CHECK_EQ(receiver.lost(), 2);
}

TEST_CASE("original packets behind our own have no time and no age of the IMU") {
  ImuReceiver receiver;
  uint8_t bytes[frames::kImuPacketSize];
  frames::ImuPacket packet = {};
  packet.kind = frames::kImuPacketKind;
  packet.t_us = 5000;
  packet.age = 300;
  memcpy(bytes, &packet, sizeof bytes);
  core::put_le(bytes + 34, core::crc16(core::kCrc16Start, bytes, 34));
  REQUIRE(receiver.packet(kOwn, bytes, sizeof bytes, 0) == ImuResult::kSample);
  send_original(receiver, kFirst, kCalm, 1000);
  REQUIRE(send_original(receiver, kSecond, kPlace, 2000) == ImuResult::kSample);
  CHECK(receiver.sample().imu_t_us == 0U);
  CHECK_EQ(receiver.sample().age_4us, 0);
}

TEST_CASE("a whole packet in a longer one, of another kind or to another address is bad") {
  uint8_t bytes[40] = {};
  frames::ImuPacket packet = {};
  packet.kind = frames::kImuPacketKind;
  memcpy(bytes, &packet, sizeof packet);
  core::put_le(bytes + 34, core::crc16(core::kCrc16Start, bytes, 34));
  ImuReceiver receiver;
  CHECK(receiver.packet(kOwn, bytes, 37, 0) == ImuResult::kBad);
  CHECK(receiver.packet(kOwn + 1, bytes, 36, 0) == ImuResult::kBad);
  bytes[0] = frames::kImuPacketKind + 1;
  core::put_le(bytes + 34, core::crc16(core::kCrc16Start, bytes, 34));
  CHECK(receiver.packet(kOwn, bytes, 36, 0) == ImuResult::kBad);
  CHECK_EQ(receiver.good(), 0);
}

TEST_CASE("the number of the last sample with an earlier time is another sample") {
  ImuReceiver receiver;
  send(receiver, 10, 5000, 1000);
  CHECK(send(receiver, 10, 4000, 2000) == ImuResult::kSample);
}

TEST_CASE("an age is that of the packet and the time since, and is never cut to 16 bits") {
  ImuReceiver receiver;
  uint8_t bytes[frames::kImuPacketSize];
  frames::ImuPacket packet = {};
  packet.kind = frames::kImuPacketKind;
  packet.age = 60000;
  memcpy(bytes, &packet, sizeof bytes);
  core::put_le(bytes + 34, core::crc16(core::kCrc16Start, bytes, 34));
  receiver.packet(kOwn, bytes, sizeof bytes, 0);
  CHECK_EQ(receiver.age_4us(4UL * 5534UL), 65534U);
  CHECK_EQ(receiver.age_4us(4UL * 6000UL), frames::kIdentImuAgeInvalid);
}

TEST_CASE("the status tells the temperature, the gyro's offset does not") {
  ImuReceiver receiver;
  frames::AttitudeFrame attitude;
  send(receiver, 1, 5000, 0, static_cast<uint8_t>(frames::ImuAux::kGyroBias));
  REQUIRE(receiver.take_attitude(attitude));
  const int16_t temperature = attitude.temperature;
  CHECK(temperature != 101);
  CHECK_EQ(attitude.product_id, 0);
}

TEST_CASE("counters stop at their end") {
  ImuReceiver receiver;
  const uint8_t bytes[1] = {};
  for (uint32_t i = 0; i < 65540; ++i) receiver.packet(99, bytes, 1, 0);
  CHECK_EQ(receiver.bad(), 65535U);
}

TEST_CASE("an original value at the end of its scale is saturated, one step before it is not") {
  ImuReceiver receiver;
  float values[8] = {1.0F, 2.0F, 3.0F, 32766.0F, -32766.0F, 6.0F, 7.0F, 8.0F};
  send_original(receiver, kFirst, values, 0);
  send_original(receiver, kSecond, kPlace, 1000);
  CHECK(receiver.sample().unsaturated);
  values[3] = 32767.0F;
  send_original(receiver, kFirst, values, 20000);
  send_original(receiver, kSecond, kPlace, 21000);
  CHECK_EQ(receiver.sample().p, 32767);
  CHECK(!receiver.sample().unsaturated);
}

TEST_CASE("less than no fix is no fix, less than no satellite none, any kind of fix is one") {
  ImuReceiver receiver;
  frames::GpsFrame gps;
  float place[8] = {9.0F, 30.0F, -120.0F, 74.5F, 359.5F, 12.0F, -1.0F, 7.0F};
  send_original(receiver, kSecond, place, 0);
  REQUIRE(receiver.take_position(gps));
  CHECK_EQ(gps.fix, 0);
  place[6] = 3.0F;
  place[7] = -1.0F;
  send_original(receiver, kSecond, place, 1000);
  REQUIRE(receiver.take_position(gps));
  CHECK_EQ(gps.fix, 3);
  CHECK_EQ(gps.satellites, 0);
}
