// When a packet leaves, when a sensor is dead, what goes into the EEPROM, what is printed.
#include <string.h>

#include "check.h"
#include "core/imu/answer.h"
#include "core/imu/packet_schedule.h"
#include "core/imu/record_writer.h"
#include "core/imu/sensor_watch.h"
#include "random_numbers.h"

namespace {

bool says(const core::TextLine& line, const char* text) {
  return line.size() == strlen(text) && memcmp(line.bytes(), text, line.size()) == 0;
}

core::ImuSettings some_settings(int16_t offset) {
  core::ImuSettings out;
  core::default_imu_settings(out);
  for (uint8_t axis = 0; axis < 3; ++axis) {
    out.rate_offset[axis] = static_cast<int16_t>(offset + axis);
    out.force_offset[axis] = static_cast<int16_t>(-offset - axis);
  }
  out.offsets_valid = 1;
  return out;
}

}  // namespace

TEST_CASE("a packet is due once, 260 us before its START, 3 ms behind its sample") {
  const uint32_t samples_us[] = {0, 1234567, 0xFFFFF000U, 0xFFFFFFFFU};  // over the wrap too
  for (const uint32_t sample_us : samples_us) {
    core::PacketSchedule schedule;
    CHECK(!schedule.due(sample_us));
    schedule.sampled(sample_us);
    CHECK(schedule.waits());
    CHECK_EQ(schedule.wake_us(), sample_us + 2740);
    CHECK(!schedule.due(sample_us + 2739));
    CHECK(schedule.waits());
    CHECK(schedule.due(sample_us + 2740));
    CHECK(!schedule.waits());
    CHECK(!schedule.due(sample_us + 2741));
    CHECK_EQ(schedule.start_us(sample_us + 2740), sample_us + 3000);
  }
}

TEST_CASE("a packet that is late starts as soon as it can be sealed, never before its time") {
  Random random(11);
  for (uint16_t i = 0; i < 500; ++i) {
    const uint32_t sample_us = (static_cast<uint32_t>(random.below(0xFFFF)) << 16) + i;
    const uint16_t after_us = static_cast<uint16_t>(2740 + random.below(6000));
    core::PacketSchedule schedule;
    schedule.sampled(sample_us);
    const uint32_t now_us = sample_us + after_us;
    REQUIRE(schedule.due(now_us));
    const uint32_t start_us = schedule.start_us(now_us);
    CHECK_EQ(start_us - now_us, 260U);
    CHECK(start_us - sample_us >= 3000U);
  }
}

TEST_CASE("a sample before the last one's packet was sealed takes its place") {
  core::PacketSchedule schedule;
  schedule.sampled(1000);
  schedule.sampled(3500);
  CHECK(!schedule.due(3740));
  CHECK(schedule.due(6240));
  CHECK(!schedule.due(9000));
}

TEST_CASE("a sensor is dead after 20 ms without a sample, over the clock's wrap too") {
  core::SensorWatch watch;
  uint32_t now_us = 0xFFFFF000U;
  watch.found(now_us);
  for (uint8_t i = 0; i < 10; ++i) {
    CHECK(!watch.silent(now_us + 20000));
    CHECK(watch.silent(now_us + 20001));
    now_us += 5000;
    watch.sampled(now_us);
  }
}

TEST_CASE("the other bus is tried once a second until a chip was found, then never") {
  core::SensorWatch watch;
  uint32_t now_us = 0xFFF00000U;
  watch.start(now_us);
  uint8_t tries = 0;
  for (uint16_t ms = 0; ms < 3500; ++ms) {
    now_us += 1000;
    tries = static_cast<uint8_t>(tries + (watch.other_bus_due(now_us) ? 1 : 0));
  }
  CHECK_EQ(tries, 3);
  watch.found(now_us);
  tries = 0;
  for (uint16_t ms = 0; ms < 5500; ++ms) {
    now_us += 1000;
    tries = static_cast<uint8_t>(tries + (watch.other_bus_due(now_us) ? 1 : 0));
  }
  CHECK_EQ(tries, 0);
}

TEST_CASE("a record cut off at any byte counts as none, a whole one as the new settings") {
  uint8_t memory[core::kImuRecordSize];
  for (uint8_t cut = 0; cut <= core::kImuRecordSize; ++cut) {
    core::write_imu_record(memory, some_settings(100));
    core::RecordWriter writer;
    writer.keep(some_settings(-321));
    uint8_t address = 0;
    uint8_t value = 0;
    uint8_t written = 0;
    for (; written < cut && writer.take(address, value); ++written) {
      CHECK_EQ(address, written);
      memory[address] = value;
    }
    REQUIRE(written == cut);
    core::ImuSettings found;
    const bool whole = core::read_imu_record(memory, found);
    // Magic, version and size are the same in both: until they have passed it is the old record.
    CHECK_EQ(whole, cut <= 4 || cut == core::kImuRecordSize);
    if (whole) {
      CHECK_EQ(found.rate_offset[0], cut <= 4 ? 100 : -321);
    }
  }
}

TEST_CASE("nothing is written unasked; settings kept again in between start anew") {
  core::RecordWriter writer;
  uint8_t address = 99;
  uint8_t value = 0;
  CHECK(!writer.take(address, value));
  writer.keep(some_settings(1));
  for (uint8_t i = 0; i < 10; ++i) {
    CHECK(writer.take(address, value));
  }
  writer.keep(some_settings(2));
  uint8_t memory[core::kImuRecordSize] = {};
  uint8_t bytes = 0;
  while (writer.take(address, value)) {
    memory[address] = value;
    ++bytes;
  }
  CHECK_EQ(bytes, core::kImuRecordSize);
  core::ImuSettings found;
  REQUIRE(core::read_imu_record(memory, found));
  CHECK_EQ(found.rate_offset[0], 2);
}

TEST_CASE("the answers, letter by letter") {
  const core::ImuSettings settings = some_settings(-7);
  core::TextLine kept, moving, unknown, none, image;
  core::put_answer(kept, core::ImuReply::kChanged, settings);
  CHECK(says(kept, "imu: kept\r\n"));
  core::put_answer(moving, core::ImuReply::kMoving, settings);
  CHECK(says(moving, "imu: not at rest, nothing changed\r\n"));
  core::put_answer(unknown, core::ImuReply::kUnknown, settings);
  CHECK(says(unknown, "imu: zero level show declination iron dlpf compat\r\n"));
  core::put_answer(none, core::ImuReply::kNone, settings);
  CHECK_EQ(none.size(), 0);
  core::put_image(image, 0x0123ABCDU);
  CHECK(says(image, "imu image 0123abcd\r\n"));
}

TEST_CASE("the settings as shown, and at their longest still one whole line") {
  core::ImuSettings settings = some_settings(-7);
  settings.declination_cdeg = 413;
  settings.dlpf = 3;
  settings.compat = 1;
  core::TextLine shown;
  core::put_answer(shown, core::ImuReply::kShow, settings);
  CHECK(says(shown, "imu -7 -6 -5 7 6 5 413 3 1 1\r\n"));
  settings.dlpf = settings.compat = settings.offsets_valid = 0;
  settings.rate_offset[0] = 10;
  settings.force_offset[2] = -1;
  core::TextLine zeros;
  core::put_answer(zeros, core::ImuReply::kShow, settings);
  CHECK(says(zeros, "imu 10 -6 -5 7 6 -1 413 0 0 0\r\n"));
  settings.dlpf = 3;
  settings.compat = settings.offsets_valid = 1;
  for (uint8_t axis = 0; axis < 3; ++axis) {
    settings.rate_offset[axis] = INT16_MIN;
    settings.force_offset[axis] = INT16_MIN;
  }
  settings.declination_cdeg = -18000;
  core::TextLine longest;
  core::put_answer(longest, core::ImuReply::kShow, settings);
  CHECK(says(longest, "imu -32768 -32768 -32768 -32768 -32768 -32768 -18000 3 1 1\r\n"));
}

TEST_CASE("what does not fit a line is left out, and nothing behind it is touched") {
  struct {
    core::TextLine line;
    uint8_t behind[4] = {1, 2, 3, 4};
  } room;
  for (uint8_t i = 0; i < 40; ++i) {
    room.line.number(INT16_MIN);
    room.line.hex(0xFFFFFFFFU);
  }
  CHECK_EQ(room.line.size(), uint8_t{core::TextLine::kLongest});
  CHECK_EQ(room.behind[0], 1);
}

TEST_CASE("a packet sealed early waits for its time, one sealed a microsecond late does not") {
  const uint32_t samples_us[] = {50000, 0xFFFFFFFFU - 2900U, 0x7FFFFFFFU - 2900U};
  for (const uint32_t sample_us : samples_us) {
    core::PacketSchedule schedule;
    schedule.sampled(sample_us);
    for (uint32_t after_us = 0; after_us <= 2740; after_us += 137) {
      CHECK_EQ(schedule.start_us(sample_us + after_us), sample_us + 3000);
    }
    CHECK_EQ(schedule.start_us(sample_us + 2741), sample_us + 3001);
    CHECK_EQ(schedule.start_us(sample_us + 9000), sample_us + 9260);
  }
}

TEST_CASE("the other bus: behind a second and a microsecond, each time anew") {
  core::SensorWatch watch;
  const uint32_t start_us = 0xFFFFFFFFU - 500000U;
  watch.start(start_us);
  CHECK(!watch.other_bus_due(start_us + 1));
  CHECK(!watch.other_bus_due(start_us + 999999));
  CHECK(!watch.other_bus_due(start_us + 1000000));
  CHECK(watch.other_bus_due(start_us + 1000001));
  CHECK(!watch.other_bus_due(start_us + 2000001));
  CHECK(watch.other_bus_due(start_us + 2000002));
  CHECK(watch.other_bus_due(start_us + 9000000));
}
