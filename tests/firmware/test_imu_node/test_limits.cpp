// What the node hands on: each flag alone, each kind of aux, each limit from both sides; its angles
// are those of a filter of the test's own that is given the same.
#include <string.h>

#include "check.h"
#include "core/imu/console.h"
#include "core/imu/node.h"

namespace {

struct Imu {
  core::ImuSettings settings;
  core::ImuNode node;
  core::ImuRawSample raw = {};
  uint32_t t_us = 0xFFFFF000U;

  Imu() : settings(defaults()), node(settings) {
    raw.force[2] = -8192;
    raw.temperature_cdegc = -1234;
  }
  static core::ImuSettings defaults() {
    core::ImuSettings out;
    core::default_imu_settings(out);
    return out;
  }
  void run(uint16_t samples, uint16_t period_us = 5000) {
    for (uint16_t i = 0; i < samples; ++i) {
      t_us += period_us;
      node.sample(raw, t_us);
      node.catch_up();
    }
  }
  frames::ImuPacket packet(uint32_t after_us = 3000) {
    frames::ImuPacket out;
    uint8_t bytes[sizeof(out)];
    node.put_packet(bytes, t_us + after_us);
    memcpy(&out, bytes, sizeof(out));
    return out;
  }
  void gps(core::ImuNode& to, frames::GpsFix fix, uint16_t speed_cmps) {
    frames::GpsFrame frame = {};
    frame.fix = static_cast<uint8_t>(fix);
    frame.ground_speed = speed_cmps;
    to.set_gps(frame);
  }
};

}  // namespace

TEST_CASE("a filter given the same has the same angles: the chip's delay, the steps, the speed") {
  // Gyro delay by DLPF_CFG, MPU-6000 register map, 4.3: 0.98, 1.9, 2.8, 4.8, 8.3, 13.4, 18.6 ms.
  const uint16_t delays_us[] = {1000, 1900, 2800, 4800, 8300, 13400, 18600, 2800};
  for (uint8_t dlpf = 0; dlpf < 8; ++dlpf) {
    Imu imu;
    imu.settings.declination_cdeg = -250;
    imu.node.set_chip(1, dlpf);
    core::AttitudeSettings tuning;
    tuning.declination_cdeg = -250;
    tuning.filter_delay_us = delays_us[dlpf];
    core::Attitude own(tuning);
    core::AttitudeInput in;
    in.force[2] = -8192;
    const int16_t field[3] = {700, -300, 500};
    for (uint16_t i = 0; i < 200; ++i) {
      const uint16_t period_us = static_cast<uint16_t>(i == 0 ? 5000 : 4000 + i % 7 * 400);
      imu.raw.rates[0] = in.rates[0] = static_cast<int16_t>(2000 - 9 * i);
      imu.raw.rates[1] = in.rates[1] = static_cast<int16_t>(300 + i);
      imu.raw.rates[2] = in.rates[2] = 1500;
      imu.raw.force[1] = in.force[1] = static_cast<int16_t>(i * 11);
      if (i == 50) {
        imu.gps(imu.node, frames::GpsFix::kFix3d, 2500);
        own.set_speed(2500);
      }
      if (i == 60) {  // none of these is a speed
        imu.gps(imu.node, frames::GpsFix::kFix2d, 9000);
        imu.gps(imu.node, frames::GpsFix::kFix3d, frames::kGpsGroundSpeedInvalid);
      }
      if (i % 10 == 3) {
        imu.node.set_field(field);
        own.set_field(field);
      }
      imu.run(1, period_us);
      own.step(in, period_us);
      own.catch_up();
      const frames::ImuPacket packet = imu.packet();
      CHECK_EQ(int16_t{packet.phi}, own.phi_cdeg());
      CHECK_EQ(int16_t{packet.theta}, own.theta_cdeg());
      CHECK_EQ(int16_t{packet.psi}, own.psi_cdeg());
    }
  }
}

TEST_CASE("each flag by itself") {
  Imu imu;
  imu.run(1);
  CHECK_EQ(imu.node.flags(), frames::kImuFlagsRestarted);
  imu.raw.gyro_saturated = true;
  imu.run(1);
  CHECK_EQ(imu.packet().flags, frames::kImuFlagsRestarted | frames::kImuFlagsGyroSaturated);
  imu.raw.gyro_saturated = false;
  imu.raw.accel_saturated = true;
  imu.run(1);
  CHECK_EQ(imu.packet().flags, frames::kImuFlagsRestarted | frames::kImuFlagsAccelSaturated);
  imu.raw.accel_saturated = false;
  imu.settings.offsets_valid = 1;
  imu.run(396);
  CHECK_EQ(imu.node.flags(), frames::kImuFlagsRestarted | frames::kImuFlagsOffsetsValid);
  imu.run(1);
  CHECK_EQ(imu.node.flags(), frames::kImuFlagsOffsetsValid);
  imu.run(3000);
  CHECK_EQ(imu.node.flags(), frames::kImuFlagsOffsetsValid | frames::kImuFlagsAttitudeValid);
  const int16_t field[3] = {700, 0, 500};
  imu.node.set_field(field);
  imu.run(8);
  CHECK_EQ(
      imu.node.flags(),
      frames::kImuFlagsOffsetsValid | frames::kImuFlagsAttitudeValid | frames::kImuFlagsMagValid);
  imu.settings.offsets_valid = 0;
  CHECK_EQ(imu.node.flags(), frames::kImuFlagsAttitudeValid | frames::kImuFlagsMagValid);
}

TEST_CASE("aux: the field once, else bias and state in turns, every value at its place") {
  Imu imu;
  imu.node.set_chip(0x68, 4);
  imu.node.count_reset(513);
  imu.raw.rates[0] = 30;
  imu.raw.rates[1] = -55;
  imu.raw.rates[2] = 80;
  imu.run(601);  // odd
  frames::ImuPacket packet = imu.packet();
  CHECK_EQ(packet.seq, static_cast<uint8_t>(601));
  CHECK_EQ(packet.aux_kind, static_cast<uint8_t>(frames::ImuAux::kGyroBias));
  for (uint8_t axis = 0; axis < 3; ++axis) {
    CHECK_EQ(int16_t{packet.aux[axis]}, imu.node.attitude().bias(axis));
    CHECK(imu.node.attitude().bias(axis) > imu.raw.rates[axis] - 3);
    CHECK(imu.node.attitude().bias(axis) < imu.raw.rates[axis] + 3);
  }
  imu.run(1);
  packet = imu.packet();
  CHECK_EQ(packet.aux_kind, static_cast<uint8_t>(frames::ImuAux::kStatus));
  CHECK_EQ(int16_t{packet.aux[0]}, -1234);
  CHECK_EQ(int16_t{packet.aux[1]}, 0x0468);
  CHECK_EQ(int16_t{packet.aux[2]}, 513);
  imu.settings.field_offset[0] = 1;
  imu.settings.field_offset[1] = -2;
  imu.settings.field_offset[2] = 3;
  const int16_t field[3] = {11, 22, -32768};
  imu.node.set_field(field);
  packet = imu.packet();
  CHECK_EQ(packet.aux_kind, static_cast<uint8_t>(frames::ImuAux::kMagnetometer));
  CHECK_EQ(int16_t{packet.aux[0]}, 10);
  CHECK_EQ(int16_t{packet.aux[1]}, 24);
  CHECK_EQ(int16_t{packet.aux[2]}, -32767);
  CHECK_EQ(imu.packet().aux_kind, static_cast<uint8_t>(frames::ImuAux::kStatus));
}

TEST_CASE("age: to the nearest 4 us, and at its end where it is longer") {
  Imu imu;
  imu.run(1);
  CHECK_EQ(imu.packet(0).age, 0);
  CHECK_EQ(imu.packet(1).age, 0);
  CHECK_EQ(imu.packet(2).age, 1);
  CHECK_EQ(imu.packet(5).age, 1);
  CHECK_EQ(imu.packet(6).age, 2);
  CHECK_EQ(imu.packet(262137).age, 0xFFFE);
  CHECK_EQ(imu.packet(262138).age, 0xFFFF);
  CHECK_EQ(imu.packet(262142).age, 0xFFFF);
  CHECK_EQ(imu.packet(3000000).age, 0xFFFF);
  CHECK_EQ(uint32_t{imu.packet().t_us}, imu.t_us);
}

TEST_CASE("offsets come off every axis, and the end of the scale is kept") {
  Imu imu;
  const int16_t offsets[3] = {100, -200, 300};
  for (uint8_t axis = 0; axis < 3; ++axis) {
    imu.settings.rate_offset[axis] = offsets[axis];
    imu.settings.force_offset[axis] = static_cast<int16_t>(-offsets[axis]);
    imu.raw.rates[axis] = 1000;
    imu.raw.force[axis] = 2000;
  }
  imu.run(1);
  frames::ImuPacket packet = imu.packet();
  CHECK_EQ(int16_t{packet.p}, 900);
  CHECK_EQ(int16_t{packet.q}, 1200);
  CHECK_EQ(int16_t{packet.r}, 700);
  CHECK_EQ(int16_t{packet.ax}, 2100);
  CHECK_EQ(int16_t{packet.ay}, 1800);
  CHECK_EQ(int16_t{packet.az}, 2300);
  const struct {
    int16_t raw, offset, less;
  } ends[] = {{32767, 0, 32767},
              {32767, -1, 32767},
              {32766, -1, 32767},
              {-32767, 0, -32767},
              {-32767, 1, -32767},
              {-32766, 1, -32767},
              {-32768, 0, -32767},
              {-32766, 0, -32766}};
  for (const auto& end : ends) {
    imu.raw.rates[1] = end.raw;
    imu.settings.rate_offset[1] = end.offset;
    imu.run(1);
    CHECK_EQ(int16_t{imu.packet().q}, end.less);
  }
}

TEST_CASE("zero and level take every axis; a GPS that says more than 3 m/s forbids both") {
  Imu imu;
  imu.raw.rates[0] = 30;
  imu.raw.rates[1] = -55;
  imu.raw.rates[2] = 80;
  imu.raw.force[0] = 150;
  imu.raw.force[1] = -250;
  imu.raw.force[2] = -8000;
  imu.run(400);
  imu.gps(imu.node, frames::GpsFix::kFix3d, 301);
  CHECK(!imu.node.at_rest());
  CHECK(!imu.node.zero_rates());
  CHECK(!imu.node.level());
  imu.gps(imu.node, frames::GpsFix::kFix2d, 301);
  CHECK(imu.node.at_rest());
  imu.gps(imu.node, frames::GpsFix::kFix3d, frames::kGpsGroundSpeedInvalid);
  CHECK(imu.node.at_rest());
  imu.gps(imu.node, frames::GpsFix::kFix3d, 300);
  REQUIRE(imu.node.zero_rates());
  REQUIRE(imu.node.level());
  for (uint8_t axis = 0; axis < 3; ++axis) {
    CHECK_EQ(int16_t{imu.settings.rate_offset[axis]}, imu.raw.rates[axis]);
  }
  CHECK_EQ(int16_t{imu.settings.force_offset[0]}, 150);
  CHECK_EQ(int16_t{imu.settings.force_offset[1]}, -250);
  CHECK_EQ(int16_t{imu.settings.force_offset[2]}, 192);
  CHECK_EQ(int16_t{imu.settings.offsets_cdegc}, -1234);
  CHECK_EQ(imu.settings.offsets_valid, 1);
  // What was learned before belongs to the old offsets.
  for (uint8_t axis = 0; axis < 3; ++axis) {
    CHECK_EQ(imu.node.attitude().bias(axis), 0);
  }
}

TEST_CASE("the original packets: every fourth sample, when they are asked for") {
  Imu imu;
  for (uint16_t i = 1; i <= 20; ++i) {
    imu.run(1);
    imu.settings.compat = 0;
    CHECK(!imu.node.compat_due());
    imu.settings.compat = 1;
    CHECK_EQ(imu.node.compat_due(), i % 4 == 0);
  }
  imu.node.skip();
  CHECK_EQ(imu.packet().seq, 21);
}

TEST_CASE("the console: what is no digit is refused, and a line of 27 letters is the longest") {
  using core::ImuReply;
  Imu imu;
  core::ImuConsole console;
  imu.run(400);
  const auto say = [&](const char* text) {
    for (; *text != 0; ++text) {
      console.byte(static_cast<uint8_t>(*text), imu.node, imu.settings);
    }
    return console.byte('\n', imu.node, imu.settings);
  };
  const char* const unknown[] = {"imu declination 1/",
                                 "imu declination 1:",
                                 "imu declination /",
                                 "imu declination :",
                                 "imu declination -",
                                 "imu declination - 1",
                                 "imu declination --1",
                                 "imu declination",
                                 "imu declination 1 ",
                                 "imu dlpf -1",
                                 "imu dlpf 7",
                                 "imu compat -1",
                                 "imu compat 2",
                                 "imu show\xC3",
                                 "imu show1",
                                 "imu",
                                 "imu iron 2049 0 0",
                                 "imu iron -2049 0 0",
                                 "imu iron 0 2049 0",
                                 "imu iron 0 0 -2049",
                                 "imu iron 1 2 3 ",
                                 "imu iron 1,2 3",
                                 "imu declination 18001",
                                 "imu declination -18001"};
  for (const char* const text : unknown) {
    CHECK(say(text) == ImuReply::kUnknown);
  }
  const char* const other[] = {"im", "imushow", "imu\xC3show", "IMU show", "", "$GPGGA"};
  for (const char* const text : other) {
    CHECK(say(text) == ImuReply::kNone);
  }
  const struct {
    const char* text;
    int16_t value;
  } angles[] = {{"imu declination 18000", 18000},
                {"imu declination -18000", -18000},
                {"imu declination 0", 0},
                {"imu declination 1234", 1234},
                {"imu declination -5678", -5678},
                {"imu declination 09", 9}};
  for (const auto& one : angles) {
    CHECK(say(one.text) == ImuReply::kChanged);
    CHECK_EQ(int16_t{imu.settings.declination_cdeg}, one.value);
  }
  for (char digit = '0'; digit <= '6'; ++digit) {
    char text[] = "imu dlpf 0";
    text[sizeof(text) - 2] = digit;
    CHECK(say(text) == ImuReply::kChanged);
    CHECK_EQ(imu.settings.dlpf, digit - '0');
  }
  CHECK(say("imu compat 1") == ImuReply::kChanged);
  CHECK_EQ(imu.settings.compat, 1);
  CHECK(say("imu compat 0") == ImuReply::kChanged);
  CHECK_EQ(imu.settings.compat, 0);
  CHECK(say("imu iron 2048 -2048 7") == ImuReply::kChanged);
  CHECK_EQ(int16_t{imu.settings.field_offset[0]}, 2048);
  CHECK_EQ(int16_t{imu.settings.field_offset[1]}, -2048);
  CHECK_EQ(int16_t{imu.settings.field_offset[2]}, 7);
  char line[80] = "imu show ";
  for (uint8_t size = 9; size < 70; ++size) {
    line[size] = 'x';
    line[size + 1] = 0;
    const bool fits = size + 1 <= 27;
    CHECK(say(line) == (fits ? ImuReply::kShow : ImuReply::kNone));
    CHECK(say("imu show") == ImuReply::kShow);
  }
  CHECK(say("imu level now") == ImuReply::kChanged);
  CHECK(say("imu zero") == ImuReply::kChanged);
  imu.raw.rates[0] = 3000;
  imu.run(1);
  imu.raw.rates[0] = 0;
  imu.run(1);
  CHECK(say("imu level") == ImuReply::kMoving);
  CHECK(say("imu zero") == ImuReply::kMoving);
  CHECK(say("imu compat 1") == ImuReply::kMoving);
  CHECK_EQ(imu.settings.compat, 0);
}
