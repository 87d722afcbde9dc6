// TWI as a slave only: the IMU is the master of this bus and pushes packets.
// ATmega2560 datasheet (DS40002211A) section 24.7.3, table 24-4.
#include "hal/imu_bus.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/twi.h>

#include "boards/avr/interrupts_off.h"
#include "boards/mega2560/board.h"
#include "core/ident_trigger.h"
#include "hal/clock.h"

// Shared with the assembly below, hence a C name, kept by the linker.
extern "C" {
uint8_t imu_bus_room __attribute__((used, externally_visible));  // bytes still taken; else 0
}

// Where the next byte goes, in a cycle's reach: timer 0 stands still, and its registers are memory.
#define IMU_BUS_TO_LOW OCR0A
#define IMU_BUS_TO_HIGH OCR0B

namespace {

// 42 with its bits 0x31 ignored: 42, 43 and 27 answer (and 10, 11, 26, 58, 59, which nobody uses).
constexpr uint8_t kAddress = 42;
constexpr uint8_t kIgnored = 0x31;

constexpr uint8_t kGo = _BV(TWINT) | _BV(TWEA) | _BV(TWEN) | _BV(TWIE);
constexpr uint8_t kMaskedKeep = _BV(TWEA) | _BV(TWEN);  // a zero in TWINT leaves the flag set
constexpr uint8_t kNone = 2;
// Ten bits at 400 kHz, the IMU's interrupt between START and address, the way into this one: 25, 4
// and 10 us (measured, simulated chips).
constexpr uint8_t kSinceStartTicks = 78;

hal::ImuPacket g_packets[2];
volatile uint8_t g_filling = kNone;  // buffer under way; interrupt only
uint16_t g_start_ticks[2];
volatile uint8_t g_full;   // packets waiting, 0 to 2
volatile uint8_t g_first;  // oldest of them
volatile uint16_t g_lost;

void begin_packet() {
  const uint8_t waiting = g_full;
  imu_bus_room = 0;
  if (waiting == 2) {
    ++g_lost;
    g_filling = kNone;
    return;
  }
  const uint8_t next = (g_first + waiting) & 1U;
  hal::ImuPacket& packet = g_packets[next];
  {
    // The low half of now_ticks(): a call here would make the interrupt save every register.
    const avr::InterruptsOff guard;
    g_start_ticks[next] = uint16_t(TCNT5 - kSinceStartTicks);
  }
  packet.address = uint8_t(TWDR >> 1);
  const uint16_t to = uint16_t(packet.bytes);
  IMU_BUS_TO_LOW = uint8_t(to);
  IMU_BUS_TO_HIGH = uint8_t(to >> 8);
  imu_bus_room = hal::kImuPacketBytes;
  g_filling = next;
}

// The scan begins before anything else that a packet entails: 8 us behind its STOP.
void start_scan_of(const uint8_t filling) {
  hal::ImuPacket& packet = g_packets[filling];
  packet.scan_after_us = 0;
  const uint8_t mask = mega::g_scan_mask;
  if (mask == mega::kScanUnarmed || mega::adc_busy() ||
      !core::starts_scan(packet.address, packet.length, packet.bytes, mask)) {
    return;
  }
  mega::g_scan_mask = mega::kScanUnarmed;
  mega::g_scan_waits = true;
  const uint16_t started_ticks = mega::begin_scan();
  packet.scan_after_us = uint16_t(started_ticks - g_start_ticks[filling]) >> 1;
}

void end_packet() {
  const uint8_t filling = g_filling;
  if (filling != kNone) {
    g_packets[filling].length = uint8_t(hal::kImuPacketBytes - imu_bus_room);
    imu_bus_room = 0;
    g_filling = kNone;
    start_scan_of(filling);
    // Stamped, and its scan begun: it may wait for the next millisecond. A turn of the main loop of
    // its own, 200 times a second, was 1.6 % of the chip.
    const avr::InterruptsOff guard;
    ++g_full;
  }
}

}  // namespace

// What comes once a packet, called with TWI's enable bit off and interrupts on.
extern "C" void __vector_imu_bus_event(void) __attribute__((signal, used, externally_visible));
void __vector_imu_bus_event(void) {
  uint8_t next = kGo;
  switch (TW_STATUS) {
    case TW_SR_SLA_ACK:
    case TW_SR_GCALL_ACK:
      begin_packet();
      break;
    case TW_SR_STOP:
      end_packet();
      break;
    case TW_BUS_ERROR:
      g_filling = kNone;
      imu_bus_room = 0;
      next = kGo | _BV(TWSTO);  // lets go of the lines, sends nothing
      break;
    default:
      g_filling = kNone;
      imu_bus_room = 0;
      break;
  }
  TWCR = next;  // the next event is a byte away: 22 us
}

// The bus waits (SCL low) from the flag to the write of TWINT, so no byte is lost, only slowed. A
// byte of a packet, 36 times of 38, is stored here in 55 cycles; the compiler's way took 119. As
// board.h says, the own enable bit goes off first, then interrupts on.
ISR(TWI_vect, ISR_NAKED) {
  __asm__ __volatile__(
      "push r24 \n\t"
      "in r24, __SREG__ \n\t"
      "push r24 \n\t"
      "ldi r24, %[masked] \n\t"
      "sts %[control], r24 \n\t"
      "sei \n\t"
      "lds r24, %[status] \n\t"  // its lower bits, the prescaler, are zero
      "cpi r24, %[data] \n\t"
      "brne 2f \n\t"
      "lds r24, imu_bus_room \n\t"
      "subi r24, 1 \n\t"
      "brcs 1f \n\t"
      "sts imu_bus_room, r24 \n\t"
      "push r30 \n\t"
      "push r31 \n\t"
      "in r30, %[to_low] \n\t"
      "in r31, %[to_high] \n\t"
      "lds r24, %[byte] \n\t"
      "st Z+, r24 \n\t"
      "out %[to_low], r30 \n\t"
      "out %[to_high], r31 \n\t"
      "pop r31 \n\t"
      "pop r30 \n\t"
      "1: ldi r24, %[go] \n\t"
      "sts %[control], r24 \n\t"
      "pop r24 \n\t"
      "out __SREG__, r24 \n\t"
      "pop r24 \n\t"
      "reti \n\t"
      "2: pop r24 \n\t"
      "out __SREG__, r24 \n\t"
      "pop r24 \n\t"
      "sei \n\t"
      "jmp __vector_imu_bus_event \n\t" ::[masked] "M"(int(kMaskedKeep)),
      [to_low] "I"(_SFR_IO_ADDR(IMU_BUS_TO_LOW)),
      [to_high] "I"(_SFR_IO_ADDR(IMU_BUS_TO_HIGH)),
      [control] "n"(_SFR_MEM_ADDR(TWCR)),
      [status] "n"(_SFR_MEM_ADDR(TWSR)),
      [byte] "n"(_SFR_MEM_ADDR(TWDR)),
      [data] "M"(TW_SR_DATA_ACK),
      [go] "M"(int(kGo)));
}

namespace hal {

void start_imu_bus() {
  TWAR = uint8_t(kAddress << 1);
  TWAMR = uint8_t(kIgnored << 1);
  TWCR = kGo;
}

bool imu_packet_waits() {
  return g_full != 0;
}

const ImuPacket* imu_packet() {
  if (g_full == 0) {
    return nullptr;
  }
  // Stamps are extended here: within 32 ms of the packet, or they are that much too late.
  const uint8_t first = g_first;
  hal::ImuPacket& packet = g_packets[first];
  // One look at the clock for both: between two an interrupt would make the packet younger.
  const uint32_t at_us = now_us();
  const uint16_t age_ticks = uint16_t(uint16_t(at_us << 1) - g_start_ticks[first]);
  packet.start_us = at_us - (age_ticks >> 1);
  return &packet;
}

void release_imu_packet() {
  if (g_full == 0) {
    return;
  }
  if (g_packets[g_first].scan_after_us != 0) {
    mega::take_scan();
  } else {
    mega::g_packet_taken = true;
  }
  const avr::InterruptsOff guard;
  g_first = (g_first + 1U) & 1U;
  --g_full;
}

uint16_t lost_imu_packets() {
  const avr::InterruptsOff guard;
  return g_lost;
}

void restart_imu_bus() {
  const avr::InterruptsOff guard;
  TWCR = 0;  // lets go of SDA and SCL whatever the state
  g_filling = kNone;
  imu_bus_room = 0;
  TWCR = kGo;
}

}  // namespace hal
