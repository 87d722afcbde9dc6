// Composition root of the IMU: sensors to node, node to bus.
#include <avr/interrupt.h>
#include <avr/io.h>

#include "boards/arduimu/board.h"
#include "boards/arduimu/sensor_bus.h"
#include "boards/arduimu/serial.h"
#include "boards/arduimu/twi_master.h"
#include "core/gps_receiver.h"
#include "core/imu_console.h"
#include "core/imu_node.h"
#include "drivers/hmc5883l.h"
#include "drivers/mpu6000.h"
#include "drivers/ublox.h"
#include "hal/eeprom.h"
#include "hal/system.h"

namespace {

constexpr uint32_t kSilentUs = 20000;      // four samples: the chip or its line is dead
constexpr uint32_t kOtherBusUs = 1000000;  // no chip by SPI: an MPU-6050 by I2C, and back
// From data-ready to START, always: packets come as evenly as samples. What happens in between
// takes 2 ms, 2.7 ms when it has to wait for the magnetometer.
constexpr uint16_t kStartUs = 3000;
constexpr uint16_t kSealUs = 260;  // from the seal to START: put_packet takes 240 us

core::ImuSettings g_settings;
arduimu::MpuBus g_mpu_bus;
arduimu::MagBus g_mag_bus;
arduimu::SerialPort g_port;
drivers::Mpu6000<arduimu::MpuBus> g_mpu(g_mpu_bus, 2);
drivers::Magnetometer<arduimu::MagBus> g_mag(g_mag_bus);
drivers::Ublox<arduimu::SerialPort> g_ublox(g_port);
core::GpsReceiver g_gps;
core::ImuNode g_node(g_settings);
core::ImuConsole g_console;

uint8_t g_record[core::kImuRecordSize];
uint8_t g_record_left;  // bytes still to be written

uint8_t g_packet[frames::kImuPacketSize];
uint8_t g_second[frames::kOriginalImu2PacketSize];
bool g_second_waits;
uint32_t g_sample_us;
uint32_t g_start_us;
bool g_packet_waits;  // for its START
uint32_t g_other_bus_us;
bool g_chip_found;  // since boot: no reason to look at the other bus any more

// A record that is not whole leaves the defaults, without offsets; every packet says so.
void read_settings() {
  for (uint8_t i = 0; i < sizeof(g_record); ++i) {
    g_record[i] = hal::read_eeprom(i);
  }
  static_cast<void>(core::read_imu_record(g_record, g_settings));
}

void keep_settings() {
  core::write_imu_record(g_record, g_settings);
  g_record_left = core::kImuRecordSize;
}

void print(const char* text) {
  uint8_t size = 0;
  while (text[size] != 0) {
    ++size;
  }
  g_port.send(reinterpret_cast<const uint8_t*>(text), size);
}

void print_number(const int16_t value) {
  char text[8];
  uint8_t at = sizeof(text) - 1;
  text[at] = 0;
  uint16_t left = value < 0 ? uint16_t(0U - uint16_t(value)) : uint16_t(value);
  do {
    text[--at] = char('0' + left % 10);
    left /= 10;
  } while (left != 0);
  if (value < 0) {
    text[--at] = '-';
  }
  text[--at] = ' ';
  print(text + at);
}

// The boot line: which image this is.
void show_image() {
  char text[9] = {};
  uint32_t left = hal::image_hash();
  for (uint8_t digit = 8; digit != 0; left >>= 4) {
    const uint8_t next = uint8_t(left & 0xFU);
    text[--digit] = char(next < 10 ? '0' + next : 'a' + next - 10);
  }
  print("imu image ");
  print(text);
  print("\r\n");
}

// Offsets p q r ax ay az, declination, DLPF_CFG, compat, whether the offsets count.
void show() {
  print("imu");
  for (uint8_t axis = 0; axis < 3; ++axis) {
    print_number(g_settings.rate_offset[axis]);
  }
  for (uint8_t axis = 0; axis < 3; ++axis) {
    print_number(g_settings.force_offset[axis]);
  }
  print_number(g_settings.declination_cdeg);
  print_number(g_settings.dlpf);
  print_number(g_settings.compat);
  print_number(g_settings.offsets_valid);
  print("\r\n");
}

void serve_serial(const uint32_t now_us) {
  uint8_t byte;
  while (arduimu::take_byte(byte)) {
    if (g_gps.byte(byte, now_us)) {
      g_node.set_gps(g_gps.frame());
    }
    switch (g_console.byte(byte, g_node, g_settings)) {
      case core::ImuReply::kNone:
        break;
      case core::ImuReply::kShow:
        show();
        break;
      case core::ImuReply::kChanged:
        keep_settings();
        if (g_settings.dlpf != g_mpu.dlpf()) {
          g_mpu.set_dlpf(g_settings.dlpf);
          g_mpu.restart(now_us);
        }
        print("imu: kept\r\n");
        break;
      case core::ImuReply::kMoving:
        print("imu: not at rest, nothing changed\r\n");
        break;
      case core::ImuReply::kUnknown:
        print("imu: zero level show declination iron dlpf compat\r\n");
        break;
    }
  }
  g_ublox.poll(g_gps.messages(), now_us);
}

void send_sample() {
  if (g_settings.compat != 0) {
    if (g_node.compat_due()) {
      g_node.put_compat(g_packet, g_second);
      g_second_waits = arduimu::begin_transfer(
          frames::kOriginalImu1PacketAddress, g_packet, frames::kOriginalImu1PacketSize, 0);
    }
    return;
  }
  g_start_us = g_sample_us + kStartUs;
  g_packet_waits = true;
  arduimu::wake_at(g_start_us - kSealUs);
}

// Once the packet's time has come, or has passed because something on the bus is slow.
void seal_packet(const uint32_t now_us) {
  if (!g_packet_waits || int32_t(now_us + kSealUs - g_start_us) < 0) {
    return;
  }
  g_packet_waits = false;
  if (arduimu::poll_transfer() == arduimu::TwiStatus::kBusy) {
    return;  // the Mega is slow: this sample is missing in its sequence
  }
  const uint32_t soonest_us = arduimu::now_us() + kSealUs;
  const uint32_t start_us = int32_t(soonest_us - g_start_us) > 0 ? soonest_us : g_start_us;
  g_node.put_packet(g_packet, start_us);
  arduimu::begin_transfer_at(start_us, frames::kImuPacketAddress, g_packet, frames::kImuPacketSize);
}

void serve_sample(const uint32_t at_us, const uint8_t edges) {
  for (uint8_t missed = 1; missed < edges; ++missed) {
    g_node.skip();
  }
  drivers::MpuSample seen;
  switch (g_mpu.read(seen)) {
    case drivers::MpuStatus::kSample: {
      g_sample_us = at_us;
      core::ImuRawSample raw;
      for (uint8_t axis = 0; axis < 3; ++axis) {
        raw.rates[axis] = seen.rates[axis];
        raw.force[axis] = seen.force[axis];
      }
      raw.temperature_cdegc = seen.temperature_cdegc;
      raw.gyro_saturated = seen.gyro_saturated;
      raw.accel_saturated = seen.accel_saturated;
      g_node.sample(raw, at_us);
      send_sample();
      PORTD |= arduimu::kLed;
      break;
    }
    case drivers::MpuStatus::kNotReady:
      break;
    case drivers::MpuStatus::kBusError:
    case drivers::MpuStatus::kGarbage:
    case drivers::MpuStatus::kStuck:
      g_node.skip();  // nothing is sent; after four of them the chip is set up again
      break;
  }
}

void serve_chip(const uint32_t now_us) {
  if (g_mpu.running()) {
    if (now_us - g_sample_us > kSilentUs) {
      g_mpu.restart(now_us);
      g_other_bus_us = now_us;
      PORTD &= uint8_t(~arduimu::kLed);
    }
    return;
  }
  if (g_mpu.poll(now_us)) {
    g_node.set_chip(g_mpu.product_id(), g_mpu.dlpf());
    g_sample_us = now_us;
    g_chip_found = true;
  } else if (!g_chip_found && now_us - g_other_bus_us > kOtherBusUs) {
    g_other_bus_us = now_us;
    g_mpu_bus.try_the_other();
  }
}

// The chip's axes on the ArduIMU V3: x backward, y right, z up (the original's signs -1, 1, -1).
void serve_field(const uint32_t now_us) {
  drivers::MagSample sample;
  if (arduimu::poll_transfer() != arduimu::TwiStatus::kBusy && !g_second_waits &&
      g_mag.poll(now_us, sample)) {
    const int16_t field[3] = {
        int16_t(-sample.field[0]), sample.field[1], int16_t(-sample.field[2])};
    g_node.set_field(field);
  }
}

void serve_record() {
  if (g_record_left != 0 && hal::eeprom_ready()) {
    // The CRC stands at the end: a record cut off by the supply does not count.
    const uint8_t at = uint8_t(core::kImuRecordSize - g_record_left);
    hal::write_eeprom(at, g_record[at]);
    --g_record_left;
  }
}

}  // namespace

int main() {
  DDRD |= arduimu::kLed;
  read_settings();
  g_node.settings_changed();
  arduimu::start_clock();
  arduimu::start_spi();
  arduimu::start_twi();
  sei();
  arduimu::start_ready();
  arduimu::start_watchdog();
  g_node.count_reset(arduimu::resets());
  g_mpu.set_dlpf(g_settings.dlpf);
  g_port.set_baud(drivers::ublox::kBaud);
  show_image();
  for (;;) {
    uint32_t at_us;
    uint8_t edges;
    if (arduimu::take_ready(at_us, edges)) {
      serve_sample(at_us, edges);
    }
    const uint32_t now_us = arduimu::now_us();
    seal_packet(now_us);
    const bool idle = arduimu::poll_transfer() != arduimu::TwiStatus::kBusy;
    if (g_second_waits && idle) {
      g_second_waits = false;
      arduimu::begin_transfer(
          frames::kOriginalImu2PacketAddress, g_second, frames::kOriginalImu2PacketSize, 0);
    }
    serve_chip(now_us);
    if (!g_packet_waits) {
      g_node.catch_up();
      serve_field(now_us);
    }
    serve_serial(now_us);
    serve_record();
    hal::feed_watchdog();
    hal::sleep_until_interrupt();
  }
}
