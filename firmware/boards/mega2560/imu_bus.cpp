// TWI as a slave only: the IMU is the master of this bus and pushes packets.
// ATmega2560 datasheet (DS40002211A) section 24.7.3, table 24-4.
#include "hal/imu_bus.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/twi.h>

#include "boards/mega2560/board.h"
#include "boards/mega2560/interrupts.h"
#include "hal/clock.h"

namespace {

// 42 with its bits 0x31 ignored: 42, 43 and 27 answer (and 10, 11, 26, 58, 59, which nobody uses).
constexpr uint8_t kAddress = 42;
constexpr uint8_t kIgnored = 0x31;

constexpr uint8_t kGo = _BV(TWINT) | _BV(TWEA) | _BV(TWEN) | _BV(TWIE);
constexpr uint8_t kMaskedKeep = _BV(TWEA) | _BV(TWEN);  // a zero in TWINT leaves the flag set
constexpr uint8_t kNone = 2;

hal::ImuPacket g_packets[2];
volatile uint8_t g_filling = kNone;  // buffer under way; interrupt only
volatile uint8_t g_full;             // packets waiting, 0 to 2
volatile uint8_t g_first;            // oldest of them
volatile uint16_t g_lost;

void begin_packet() {
  const uint8_t waiting = g_full;
  if (waiting == 2) {
    ++g_lost;
    g_filling = kNone;
    return;
  }
  const uint8_t next = (g_first + waiting) & 1U;
  hal::ImuPacket& packet = g_packets[next];
  packet.start_us = hal::now_us();
  packet.address = uint8_t(TWDR >> 1);
  packet.length = 0;
  g_filling = next;
}

void add_byte() {
  const uint8_t filling = g_filling;
  if (filling == kNone) {
    return;
  }
  hal::ImuPacket& packet = g_packets[filling];
  if (packet.length < hal::kImuPacketBytes) {
    packet.bytes[packet.length] = TWDR;
    ++packet.length;
  }
}

void end_packet() {
  if (g_filling != kNone) {
    g_filling = kNone;
    mega::g_awake = true;
    const mega::InterruptsOff guard;
    ++g_full;
  }
}

}  // namespace

// The bus waits (SCL low) from the flag to the write of TWINT, so no byte is lost, only slowed:
// about 8 us a byte on a bus that takes 22.5 us for one at 400 kHz.
NESTING_ISR(TWI_vect, TWCR, kMaskedKeep) {
  uint8_t next = kGo;
  switch (TW_STATUS) {
    case TW_SR_SLA_ACK:
    case TW_SR_GCALL_ACK:
      begin_packet();
      break;
    case TW_SR_DATA_ACK:
    case TW_SR_DATA_NACK:
      add_byte();
      break;
    case TW_SR_STOP:
      end_packet();
      break;
    case TW_BUS_ERROR:
      g_filling = kNone;
      next = kGo | _BV(TWSTO);  // lets go of the lines, sends nothing
      break;
    default:
      g_filling = kNone;
      break;
  }
  TWCR = next;  // the next event is a byte away: 22 us
}

namespace hal {

void start_imu_bus() {
  TWAR = uint8_t(kAddress << 1);
  TWAMR = uint8_t(kIgnored << 1);
  TWCR = kGo;
}

const ImuPacket* imu_packet() {
  return g_full == 0 ? nullptr : &g_packets[g_first];
}

void release_imu_packet() {
  const mega::InterruptsOff guard;
  if (g_full != 0) {
    g_first = (g_first + 1U) & 1U;
    --g_full;
  }
}

uint16_t lost_imu_packets() {
  const mega::InterruptsOff guard;
  return g_lost;
}

void restart_imu_bus() {
  const mega::InterruptsOff guard;
  TWCR = 0;  // lets go of SDA and SCL whatever the state
  g_filling = kNone;
  TWCR = kGo;
}

}  // namespace hal
