#include "world.h"

#include <string.h>

#include "hal/bus_master.h"
#include "hal/clock.h"
#include "hal/data_ready.h"
#include "hal/eeprom.h"
#include "hal/panel.h"
#include "hal/sensor_spi.h"
#include "hal/serial.h"
#include "hal/system.h"

World world;

World::World() {
  registers[0x75] = 0x68;
  registers[0x0C] = 0x58;
  memset(eeprom, 0xFF, sizeof(eeprom));
}

void World::end_transfer() {
  busy = false;
  frames::ImuPacket packet;
  if (address == frames::kImuPacketAddress) {
    memcpy(&packet, bytes, sizeof(packet));
    if (packet.aux_kind == static_cast<uint8_t>(frames::ImuAux::kStatus)) {
      memcpy(&told_restarts, packet.aux + 2, sizeof(told_restarts));
    }
  }
  if (mega.packet(address, bytes, size, start_us) == core::ImuResult::kSample) {
    ++samples;
  }
}

void World::pass_to(uint32_t at_us) {
  if (static_cast<int32_t>(at_us - now_us) > 0) {
    pass(at_us - now_us);
  }
}

void World::pass(uint32_t us) {
  now_us += us;
  if (!samples_run()) {
    next_edge_us = now_us + kPeriodUs;
  }
  while (static_cast<int32_t>(now_us - next_edge_us) >= 0) {
    edge_us = next_edge_us;
    next_edge_us += kPeriodUs;
    ++edges;
  }
  if (busy && now_us - start_us >= took_us) {
    end_transfer();
  }
  waiting = waiting > us / 256 ? static_cast<uint8_t>(waiting - us / 256) : uint8_t{0};
}

void World::forget_printed() {
  memset(printed, 0, sizeof(printed));
  printed_size = 0;
}

bool World::has_printed(const char* text) const {
  return strstr(printed, text) != nullptr;
}

void World::read_registers(uint8_t reg, uint8_t* out, uint8_t count) {
  if (count == 14) {
    ++bursts;
    ++noise;
    memset(registers + 0x3B, 0, 14);
    registers[0x3F] = 0x20;  // z up, at rest: 1 g
    registers[0x3B + 1] = noise & 3U;
    registers[0x43] = static_cast<uint8_t>(static_cast<uint16_t>(roll_rate) >> 8);
    registers[0x44] = static_cast<uint8_t>(roll_rate);
  }
  memcpy(out, registers + reg, count);
  if (count == 14) {
    packet_awaited = true;
    pass(work_us);
  }
}

void World::write_register(uint8_t reg, uint8_t value) {
  registers[reg] = value;
  if (reg == 0x6B && value == 0x80) {
    registers[0x38] = 0;  // reset
  }
}

bool World::sensor_transfer(uint8_t to, uint8_t* buffer, uint8_t out_size, uint8_t in_size) {
  if (to != 0x68 || !by_twi) {
    return false;
  }
  const uint8_t reg = buffer[0];
  if (in_size != 0) {
    read_registers(reg, buffer, in_size);
  } else if (out_size == 2) {
    write_register(reg, buffer[1]);
  }
  return true;
}

bool World::compass_transfer(uint8_t to, uint8_t* buffer, uint8_t, uint8_t in_size) {
  if (to != 0x1E || !compass) {
    return false;
  }
  if (in_size == 3) {
    memcpy(buffer, "H43", 3);
  } else if (in_size == 6) {
    ++field_reads;
    field_reads_in_work = static_cast<uint16_t>(field_reads_in_work + (packet_awaited ? 1 : 0));
    field[1] = static_cast<int16_t>(field[1] ^ 1);  // noise
    const uint8_t order[3] = {0, 2, 1};
    for (uint8_t i = 0; i < 3; ++i) {
      buffer[2 * i] = static_cast<uint8_t>(static_cast<uint16_t>(field[order[i]]) >> 8);
      buffer[2 * i + 1] = static_cast<uint8_t>(field[order[i]]);
    }
  }
  return true;
}

namespace hal {

uint32_t now_us() {
  return world.now_us;
}

void start_data_ready() {}

bool take_data_ready(uint32_t& at_us, uint8_t& edges) {
  at_us = world.edge_us;
  edges = world.edges;
  world.edges = 0;
  return edges != 0;
}

void wake_at(uint32_t at_us) {
  world.alarm_us = at_us;
  world.alarmed = true;
}

void start_sensor_spi() {}

void read_sensor(uint8_t reg, uint8_t* out, uint8_t size) {
  if (world.by_spi) {
    world.read_registers(reg, out, size);
  } else {
    memset(out, 0xFF, size);
  }
}

void write_sensor(uint8_t reg, uint8_t value) {
  if (world.by_spi) {
    world.write_register(reg, value);
  }
}

bool begin_transfer(uint8_t address, uint8_t* buffer, uint8_t out_size, uint8_t) {
  if (world.busy) {
    ++world.refused;
    return false;
  }
  world.busy = true;
  world.address = address;
  world.bytes = buffer;
  world.size = out_size;
  world.start_us = world.now_us;
  world.behind_us = world.now_us - world.edge_us;
  if (world.behind_us < world.least_behind_us) {
    world.least_behind_us = world.behind_us;
  }
  if (world.behind_us > world.most_behind_us) {
    world.most_behind_us = world.behind_us;
  }
  world.packet_awaited = false;
  ++world.starts;
  world.firsts =
      static_cast<uint16_t>(world.firsts + (address == frames::kOriginalImu1PacketAddress ? 1 : 0));
  world.seconds = static_cast<uint16_t>(world.seconds +
                                        (address == frames::kOriginalImu2PacketAddress ? 1 : 0));
  return true;
}

bool begin_transfer_at(uint32_t start_us, uint8_t address, uint8_t* buffer, uint8_t out_size) {
  world.late = static_cast<uint16_t>(world.late +
                                     (static_cast<int32_t>(start_us - world.now_us) < 240 ? 1 : 0));
  world.pass_to(start_us);
  return begin_transfer(address, buffer, out_size, 0);
}

TransferStatus poll_transfer() {
  return world.busy ? TransferStatus::kBusy : TransferStatus::kDone;
}

TransferStatus transfer(uint8_t address, uint8_t* buffer, uint8_t out_size, uint8_t in_size) {
  world.waits = static_cast<uint16_t>(world.waits + (world.busy ? 1 : 0));
  while (world.busy) {
    world.pass(100);
  }
  world.pass(25U * (2U + out_size + in_size));
  const bool answered = world.sensor_transfer(address, buffer, out_size, in_size) ||
                        world.compass_transfer(address, buffer, out_size, in_size);
  return answered ? TransferStatus::kDone : TransferStatus::kNoAck;
}

uint8_t read_eeprom(uint16_t address) {
  return world.eeprom[address];
}

bool eeprom_ready() {
  return world.writes == 0 || world.now_us - world.written_us >= 3400;
}

void write_eeprom(uint16_t address, uint8_t value) {
  world.writes_unready = static_cast<uint16_t>(world.writes_unready + (eeprom_ready() ? 0 : 1));
  world.eeprom[address] = value;
  world.written_us = world.now_us;
  ++world.writes;
}

void open_port(Port, uint32_t baud) {
  world.baud = baud;
  ++world.bauds;
}

bool take_byte(Port, uint8_t* byte) {
  if (world.given_size == 0) {
    return false;
  }
  *byte = *world.given++;
  --world.given_size;
  return true;
}

uint16_t send_room(Port) {
  return static_cast<uint16_t>(World::kSerialBytes - world.waiting);
}

// The setup of a GPS receiver goes the same way: what begins as UBX is no text.
void send_byte(Port, uint8_t byte) {
  ++world.waiting;
  if (byte < 0x80 && byte >= 0x0A && world.printed_size + 1U < sizeof(world.printed)) {
    world.printed[world.printed_size++] = static_cast<char>(byte);
  }
}

void set_led(bool on) {
  world.led = on;
}

void start_watchdog() {
  world.guarded = true;
}

void feed_watchdog() {
  ++world.feeds;
}

uint16_t restarts() {
  return world.restarts;
}

uint32_t image_hash() {
  return 0x0123ABCDU;
}

// Until a data-ready edge, the alarm, the end of a transfer or the next millisecond.
void sleep_until_interrupt() {
  if (world.edges != 0) {
    return;
  }
  uint32_t rest_us = 1000;
  const auto sooner = [&rest_us](uint32_t at_us) {
    const int32_t left_us = static_cast<int32_t>(at_us - world.now_us);
    if (left_us >= 0 && static_cast<uint32_t>(left_us) < rest_us) {
      rest_us = static_cast<uint32_t>(left_us);
    }
  };
  sooner(world.next_edge_us);
  if (world.alarmed) {
    sooner(world.alarm_us);
    world.alarmed = static_cast<int32_t>(world.alarm_us - world.now_us) > 0;
  }
  if (world.busy) {
    sooner(world.start_us + world.took_us);
  }
  world.pass(rest_us == 0 ? 1 : rest_us);
}

}  // namespace hal
