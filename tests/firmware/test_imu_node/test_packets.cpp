// The original packets number by number, single precision by its definition, and each limit of the
// record.
#include <string.h>

#include "check.h"
#include "core/bytes.h"
#include "core/crc.h"
#include "core/imu/original_packets.h"
#include "core/imu/record.h"
#include "random_numbers.h"

namespace {

float number(const uint8_t* bytes, uint8_t index) {
  float value = 0;
  memcpy(&value, bytes + 4 * index, 4);
  return value;
}

bool near(float value, float truth, float share) {
  const float gap = value > truth ? value - truth : truth - value;
  return gap <= share * (truth < 0 ? -truth : truth);
}

frames::GpsFrame fix() {
  frames::GpsFrame gps = {};
  gps.fix = static_cast<uint8_t>(frames::GpsFix::kFix3d);
  gps.latitude = -481234567;
  gps.longitude = 1171234567;
  gps.height = 1234567;
  gps.course = 12345;
  gps.ground_speed = 6789;
  gps.satellites = 17;
  return gps;
}

}  // namespace

TEST_CASE("single precision: sign, exponent and 24 bits, what is beyond them cut off") {
  Random random(32);
  for (uint16_t i = 0; i < 3000; ++i) {
    const uint8_t fraction_bits = static_cast<uint8_t>(random.below(32));
    const uint32_t drawn = static_cast<uint32_t>(random.below(0xFFFF)) << 16 | random.below(0xFFFF);
    const int32_t value = static_cast<int32_t>(drawn) >> random.below(32);
    const uint32_t bits = core::float32_bits(value, fraction_bits);
    if (value == 0) {
      CHECK_EQ(bits, 0U);
      continue;
    }
    CHECK_EQ(bits >> 31, value < 0 ? 1U : 0U);
    const uint64_t size = value < 0 ? 0U - static_cast<uint32_t>(value) : uint32_t(value);
    const uint64_t mantissa = (bits & 0x7FFFFFU) | 0x800000U;
    const int16_t up = static_cast<int16_t>((bits >> 23 & 0xFFU) - 150U + fraction_bits);
    if (up >= 0) {
      CHECK_EQ(size >> up, mantissa);
    } else {
      CHECK_EQ(size << -up, mantissa);
    }
  }
  CHECK_EQ(core::float32_bits(INT32_MIN, 0), 0xCF000000U);
  CHECK_EQ(core::float32_bits(0x01000000, 0), 0x4B800000U);
  CHECK_EQ(core::float32_bits(0x00FFFFFF, 0), 0x4B7FFFFFU);
  CHECK_EQ(core::float32_bits(0x00800000, 0), 0x4B000000U);
  CHECK_EQ(core::float32_bits(0x007FFFFF, 0), 0x4AFFFFFEU);
}

TEST_CASE("original packets: each value at its place, in its unit, with its sign") {
  const core::OriginalValues values = {
      {6550, -13100, 19651}, {100, -200, 300}, {1234, -5678, 17999}};
  uint8_t first[32], second[32];
  core::put_original_first(first, values);
  const float angles[] = {12.34F, -56.78F, 179.99F};
  for (uint8_t axis = 0; axis < 3; ++axis) {
    CHECK(near(number(first, axis), angles[axis], 2e-6F));
    const float rate = static_cast<float>(values.rates[axis]) * (16.4F / 65.5F);
    CHECK(near(number(first, static_cast<uint8_t>(3 + axis)), rate, 2e-5F));
  }
  CHECK_EQ(number(first, 6), -100.0F);
  CHECK_EQ(number(first, 7), 200.0F);
  core::put_original_second(second, values, fix());
  CHECK_EQ(number(second, 0), -300.0F);
  CHECK(near(number(second, 1), -48.1234567F, 3e-7F));
  CHECK(near(number(second, 2), 117.1234567F, 3e-7F));
  CHECK(near(number(second, 3), 1234.567F, 2e-6F));
  CHECK(near(number(second, 4), 123.45F, 2e-6F));
  CHECK(near(number(second, 5), 67.89F, 2e-6F));
  CHECK_EQ(number(second, 6), 1.0F);
  CHECK_EQ(number(second, 7), 17.0F);
}

TEST_CASE("original packets: without a fix zeros, and none of what a receiver cannot say") {
  const core::OriginalValues values = {{}, {0, 0, -8192}, {}};
  const uint8_t zeros[28] = {};
  for (uint8_t kind = 0; kind < 5; ++kind) {
    frames::GpsFrame gps = fix();
    gps.fix = kind;
    uint8_t second[32];
    memset(second, 0xEE, sizeof(second));
    core::put_original_second(second, values, gps);
    CHECK_EQ(number(second, 0), 8192.0F);
    const bool fixed = kind == static_cast<uint8_t>(frames::GpsFix::kFix3d);
    CHECK_EQ(memcmp(second + 4, zeros, sizeof(zeros)) != 0, fixed);
  }
  uint8_t second[32];
  frames::GpsFrame gps = fix();
  gps.course = 36000;
  gps.ground_speed = 49999;
  core::put_original_second(second, values, gps);
  CHECK(near(number(second, 4), 360.0F, 2e-6F));
  CHECK(near(number(second, 5), 499.99F, 2e-6F));
  gps.course = 36001;
  gps.ground_speed = 50000;
  core::put_original_second(second, values, gps);
  CHECK_EQ(number(second, 4), 0.0F);
  CHECK_EQ(number(second, 5), 0.0F);
  CHECK_EQ(number(second, 6), 1.0F);
}

TEST_CASE("settings: each limit from both sides, each axis") {
  core::ImuSettings settings;
  memset(&settings, 0xEE, sizeof(settings));
  core::default_imu_settings(settings);
  CHECK(core::imu_settings_in_range(settings));
  CHECK_EQ(int16_t{settings.declination_cdeg}, 413);
  CHECK_EQ(settings.dlpf, 2);
  CHECK_EQ(settings.compat, 0);
  CHECK_EQ(settings.offsets_valid, 0);
  CHECK_EQ(int16_t{settings.offsets_cdegc}, 0);
  const int16_t limits[] = {1638, 1638, 2048};
  for (uint8_t kind = 0; kind < 3; ++kind) {
    for (uint8_t axis = 0; axis < 3; ++axis) {
      for (int8_t sign = -1; sign <= 1; sign = static_cast<int8_t>(sign + 2)) {
        for (uint8_t over = 0; over < 2; ++over) {
          core::ImuSettings one = settings;
          const int16_t value = static_cast<int16_t>(sign * (limits[kind] + over));
          (kind == 0   ? one.rate_offset
           : kind == 1 ? one.force_offset
                       : one.field_offset)[axis] = value;
          CHECK_EQ(core::imu_settings_in_range(one), over == 0);
        }
      }
    }
  }
  const int16_t declinations[] = {18000, -18000, 18001, -18001};
  for (const int16_t value : declinations) {
    core::ImuSettings one = settings;
    one.declination_cdeg = value;
    CHECK_EQ(core::imu_settings_in_range(one), value <= 18000 && value >= -18000);
  }
  for (uint8_t value = 0; value < 9; ++value) {
    core::ImuSettings one = settings;
    one.offsets_valid = value;
    CHECK_EQ(core::imu_settings_in_range(one), value <= 1);
    one = settings;
    one.compat = value;
    CHECK_EQ(core::imu_settings_in_range(one), value <= 1);
    one = settings;
    one.dlpf = value;
    CHECK_EQ(core::imu_settings_in_range(one), value <= 6);
  }
}

TEST_CASE(
    "record: letters, version, size, settings and the CRC-32 of them; sealed anew another is "
    "none") {
  core::ImuSettings settings;
  core::default_imu_settings(settings);
  settings.rate_offset[2] = -77;
  uint8_t record[core::kImuRecordSize];
  core::write_imu_record(record, settings);
  CHECK_EQ(record[0], 'A');
  CHECK_EQ(record[1], 'I');
  CHECK_EQ(record[2], 1);
  CHECK_EQ(record[3], sizeof(settings));
  CHECK_EQ(memcmp(record + 4, &settings, sizeof(settings)), 0);
  const uint8_t sum_at = core::kImuRecordSize - 4;
  const auto seal = [&] {
    core::Crc32 crc;
    crc.add(record, sum_at);
    core::put_le(record + sum_at, crc.value());
  };
  const uint32_t written = core::get_le<uint32_t>(record + sum_at);
  seal();
  CHECK_EQ(core::get_le<uint32_t>(record + sum_at), written);
  core::ImuSettings read;
  CHECK(core::read_imu_record(record, read));
  CHECK_EQ(memcmp(&read, &settings, sizeof(read)), 0);
  for (uint8_t at = 0; at < 4; ++at) {
    for (int8_t by = -1; by <= 1; by = static_cast<int8_t>(by + 2)) {
      record[at] = static_cast<uint8_t>(record[at] + by);
      seal();
      CHECK(!core::read_imu_record(record, read));
      CHECK_EQ(int16_t{read.rate_offset[2]}, 0);
      CHECK_EQ(read.dlpf, 2);
      record[at] = static_cast<uint8_t>(record[at] - by);
    }
  }
}
