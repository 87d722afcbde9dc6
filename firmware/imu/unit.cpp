#include "imu/unit.h"

#include "core/imu/answer.h"
#include "hal/bus_master.h"
#include "hal/clock.h"
#include "hal/data_ready.h"
#include "hal/eeprom.h"
#include "hal/panel.h"
#include "hal/sensor_spi.h"
#include "hal/system.h"

namespace imu {
namespace {

bool bus_busy() {
  return hal::poll_transfer() == hal::TransferStatus::kBusy;
}

}  // namespace

void Unit::boot() {
  hal::set_led(false);
  read_settings();
  hal::start_sensor_spi();
  hal::start_data_ready();
  hal::start_watchdog();
  node_.count_reset(hal::restarts());
  mpu_.set_dlpf(settings_.dlpf);
  watch_.start(hal::now_us());
  link_.set_baud(drivers::ublox::kBaud);
  core::TextLine line;
  core::put_image(line, hal::image_hash());
  link_.print(line);
}

void Unit::step() {
  uint32_t at_us;
  uint8_t edges;
  if (hal::take_data_ready(at_us, edges)) {
    serve_sample(at_us, edges);
  }
  const uint32_t now_us = hal::now_us();
  seal_packet(now_us);
  send_second();
  serve_chip(now_us);
  if (!schedule_.waits()) {
    node_.catch_up();
    serve_field(now_us);
  }
  serve_serial(now_us);
  serve_record();
  hal::feed_watchdog();
  hal::sleep_until_interrupt();
}

// A record that is not whole leaves the defaults, without offsets; every packet says so.
void Unit::read_settings() {
  uint8_t record[core::kImuRecordSize];
  for (uint8_t i = 0; i < sizeof(record); ++i) {
    record[i] = hal::read_eeprom(i);
  }
  static_cast<void>(core::read_imu_record(record, settings_));
  node_.settings_changed();
}

void Unit::serve_sample(const uint32_t at_us, const uint8_t edges) {
  for (uint8_t missed = 1; missed < edges; ++missed) {
    node_.skip();
  }
  core::ImuRawSample raw;
  switch (mpu_.read(raw)) {
    case drivers::MpuStatus::kSample:
      watch_.sampled(at_us);
      node_.sample(raw, at_us);
      send_sample(at_us);
      hal::set_led(true);
      break;
    case drivers::MpuStatus::kNotReady:
      break;
    case drivers::MpuStatus::kBusError:
    case drivers::MpuStatus::kGarbage:
    case drivers::MpuStatus::kStuck:
      node_.skip();  // nothing is sent; after four of them the chip is set up again
      break;
  }
}

void Unit::send_sample(const uint32_t at_us) {
  if (settings_.compat == 0) {
    schedule_.sampled(at_us);
    hal::wake_at(schedule_.wake_us());
  } else if (node_.compat_due()) {
    node_.put_compat(packet_, second_);
    second_waits_ = hal::begin_transfer(
        frames::kOriginalImu1PacketAddress, packet_, frames::kOriginalImu1PacketSize, 0);
  }
}

void Unit::seal_packet(const uint32_t now_us) {
  // A bus still busy: the Mega is slow, and this sample is missing in its sequence.
  if (!schedule_.due(now_us) || bus_busy()) {
    return;
  }
  const uint32_t start_us = schedule_.start_us(hal::now_us());
  node_.put_packet(packet_, start_us);
  hal::begin_transfer_at(start_us, frames::kImuPacketAddress, packet_, frames::kImuPacketSize);
}

// Looks at the bus in every turn, whatever waits: that look ends a transfer that stands still.
void Unit::send_second() {
  if (bus_busy() || !second_waits_) {
    return;
  }
  second_waits_ = false;
  hal::begin_transfer(
      frames::kOriginalImu2PacketAddress, second_, frames::kOriginalImu2PacketSize, 0);
}

void Unit::serve_chip(const uint32_t now_us) {
  if (mpu_.running()) {
    if (watch_.silent(now_us)) {
      mpu_.restart(now_us);
      hal::set_led(false);
    }
  } else if (mpu_.poll(now_us)) {
    node_.set_chip(mpu_.product_id(), mpu_.dlpf());
    watch_.found(now_us);
  } else if (watch_.other_bus_due(now_us)) {
    mpu_bus_.try_the_other();
  }
}

// The chip's axes on the ArduIMU V3: x backward, y right, z up (the original's signs -1, 1, -1).
void Unit::serve_field(const uint32_t now_us) {
  drivers::MagSample sample;
  if (!bus_busy() && !second_waits_ && mag_.poll(now_us, sample)) {
    const int16_t field[3] = {static_cast<int16_t>(-sample.field[0]),
                              sample.field[1],
                              static_cast<int16_t>(-sample.field[2])};
    node_.set_field(field);
  }
}

// The same bytes may be a GPS receiver's or a command's: each looks for its own.
void Unit::serve_serial(const uint32_t now_us) {
  uint8_t byte;
  while (link_.take(byte)) {
    if (gps_.byte(byte, now_us)) {
      node_.set_gps(gps_.frame());
    }
    answer(console_.byte(byte, node_, settings_), now_us);
  }
  ublox_.poll(gps_.messages(), now_us);
}

void Unit::answer(const core::ImuReply reply, const uint32_t now_us) {
  if (reply == core::ImuReply::kNone) {
    return;
  }
  if (reply == core::ImuReply::kChanged) {
    record_.keep(settings_);
    if (settings_.dlpf != mpu_.dlpf()) {
      mpu_.set_dlpf(settings_.dlpf);
      mpu_.restart(now_us);
    }
  }
  core::TextLine line;
  core::put_answer(line, reply, settings_);
  link_.print(line);
}

void Unit::serve_record() {
  uint8_t address;
  uint8_t value;
  if (hal::eeprom_ready() && record_.take(address, value)) {
    hal::write_eeprom(address, value);
  }
}

}  // namespace imu
