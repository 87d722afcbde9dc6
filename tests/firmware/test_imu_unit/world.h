// What surrounds the IMU's program: clock, sensors, bus to the Mega, EEPROM, serial header. Time
// passes in sleep, in transfers that are waited for, and in the work on a sample.
#pragma once

#include <stdint.h>

#include "core/imu/record.h"
#include "core/imu_receiver.h"

struct World {
  static constexpr uint32_t kPeriodUs = 5000;
  static constexpr uint8_t kSerialBytes = 63;

  uint32_t now_us = 0xFFF00000U;  // wraps within the first seconds
  uint32_t alarm_us = 0;
  bool alarmed = false;

  // Gyro and accelerometer: by SPI, by the bus, or none.
  bool by_spi = true;
  bool by_twi = false;
  uint8_t registers[128] = {};
  int16_t roll_rate = 0;  // counts of the chip
  uint8_t noise = 0;
  uint16_t bursts = 0;
  uint32_t edge_us = 0;
  uint32_t next_edge_us = 0;
  uint8_t edges = 0;
  uint16_t work_us = 1900;  // from a burst to the end of the work on it

  // HMC5883L, counts of the chip.
  bool compass = false;
  int16_t field[3] = {};
  uint16_t field_reads = 0;
  uint16_t field_reads_in_work = 0;  // between a sample and its packet
  uint16_t waits = 0;                // of the main loop, for the end of another's transfer
  bool packet_awaited = false;

  // Transfers to the Mega.
  core::ImuReceiver mega;
  bool busy = false;
  uint8_t address = 0;
  uint8_t* bytes = nullptr;
  uint8_t size = 0;
  uint32_t start_us = 0;
  uint32_t took_us = 820;
  uint16_t starts = 0;
  uint16_t firsts = 0;  // of two original packets
  uint16_t seconds = 0;
  uint16_t refused = 0;    // begun while one was under way
  uint16_t samples = 0;    // as the Mega counts them
  uint32_t behind_us = 0;  // the last START behind its data-ready
  uint32_t least_behind_us = 0;
  uint32_t most_behind_us = 0;
  uint16_t late = 0;  // asked to start in the past

  uint8_t eeprom[core::kImuRecordSize] = {};
  uint32_t written_us = 0;
  uint16_t writes = 0;
  uint16_t writes_unready = 0;

  const uint8_t* given = nullptr;  // to the serial header
  uint8_t given_size = 0;
  char printed[160] = {};
  uint8_t printed_size = 0;
  uint8_t waiting = 0;
  uint32_t baud = 0;
  uint16_t bauds = 0;  // how often it was set

  bool led = false;
  bool guarded = false;
  uint16_t feeds = 0;
  uint16_t restarts = 0;
  uint16_t told_restarts = 0;  // in a packet

  World();
  void pass(uint32_t us);
  void pass_to(uint32_t at_us);
  void forget_printed();
  bool has_printed(const char* text) const;
  bool compass_transfer(uint8_t to, uint8_t* buffer, uint8_t out_size, uint8_t in_size);
  bool sensor_transfer(uint8_t to, uint8_t* buffer, uint8_t out_size, uint8_t in_size);
  void read_registers(uint8_t reg, uint8_t* out, uint8_t count);
  void write_register(uint8_t reg, uint8_t value);

 private:
  bool samples_run() const { return (by_spi || by_twi) && registers[0x38] == 1; }
  void end_transfer();
};

extern World world;
