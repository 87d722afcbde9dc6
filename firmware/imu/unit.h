// The whole IMU: sensors to node, node to bus. A board owns one, calls boot() once and step() for
// ever.
#pragma once

#include <stdint.h>

#include "core/gps_receiver.h"
#include "core/imu/console.h"
#include "core/imu/node.h"
#include "core/imu/packet_schedule.h"
#include "core/imu/record_writer.h"
#include "core/imu/sensor_watch.h"
#include "drivers/hmc5883l.h"
#include "drivers/mpu6000.h"
#include "drivers/ublox.h"
#include "generated/frames.h"
#include "imu/sensor_bus.h"
#include "imu/serial_link.h"

namespace imu {

class Unit {
 public:
  Unit() = default;
  Unit(const Unit&) = delete;
  Unit& operator=(const Unit&) = delete;

  // Behind hal::start_bus_master().
  void boot();
  // One turn of the main loop, the sleep at its end included.
  void step();

 private:
  void read_settings();
  void serve_sample(uint32_t at_us, uint8_t edges);
  void send_sample(uint32_t at_us);
  void seal_packet(uint32_t now_us);
  void send_second();
  void serve_chip(uint32_t now_us);
  void serve_field(uint32_t now_us);
  void serve_serial(uint32_t now_us);
  void answer(core::ImuReply reply, uint32_t now_us);
  void serve_record();

  core::ImuSettings settings_ = {};
  MpuBus mpu_bus_;
  MagBus mag_bus_;
  SerialLink link_;
  drivers::Mpu6000<MpuBus> mpu_{mpu_bus_, 2};
  drivers::Magnetometer<MagBus> mag_{mag_bus_};
  drivers::Ublox<SerialLink> ublox_{link_};
  core::GpsReceiver gps_;
  core::ImuNode node_{settings_};
  core::ImuConsole console_;
  core::RecordWriter record_;
  core::PacketSchedule schedule_;
  core::SensorWatch watch_;
  uint8_t packet_[frames::kImuPacketSize] = {};
  uint8_t second_[frames::kOriginalImu2PacketSize] = {};
  bool second_waits_ = false;  // of two original packets, for the end of the first
};

}  // namespace imu
