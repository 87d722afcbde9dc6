// TWI as a master at 400 kHz: ATmega328P datasheet (DS40002061B) sections 22.5 and 22.7.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/delay.h>
#include <util/twi.h>

#include "boards/avr/awake.h"
#include "hal/bus_master.h"
#include "hal/clock.h"
#include "hal/system.h"

namespace {

using hal::TransferStatus;

constexpr uint8_t kSda = 1U << 4;  // PC4
constexpr uint8_t kScl = 1U << 5;  // PC5
constexpr uint8_t kGo = _BV(TWINT) | _BV(TWEN) | _BV(TWIE);
constexpr uint8_t kStop = _BV(TWINT) | _BV(TWEN) | _BV(TWSTO);
constexpr uint8_t kStartUs = 14;

uint8_t* volatile g_buffer;
volatile uint8_t g_address;
volatile uint8_t g_out;
volatile uint8_t g_in;
volatile uint8_t g_at;
volatile uint8_t g_steps;  // of the hardware
volatile TransferStatus g_status = TransferStatus::kDone;

// Main loop only.
uint8_t g_steps_seen;
uint32_t g_step_us;
uint32_t g_begin_us;

void end(const TransferStatus status) {
  TWCR = kStop;
  g_status = status;
  avr::wake();
}

void put_next() {
  const uint8_t at = g_at;
  if (at < g_out) {
    TWDR = g_buffer[at];
    g_at = uint8_t(at + 1U);
    TWCR = kGo;
  } else if (g_in != 0) {
    g_at = 0;
    g_out = 0;
    TWCR = kGo | _BV(TWSTA);
  } else {
    end(TransferStatus::kDone);
  }
}

void ask_next() {
  TWCR = g_at + 1U < g_in ? kGo | _BV(TWEA) : kGo;
}

void take_byte() {
  const uint8_t at = g_at;
  g_buffer[at] = TWDR;
  g_at = uint8_t(at + 1U);
}

// Ends whatever was under way and frees a slave that holds SDA for a byte it believes to be in:
// UM10204, section 3.1.16. At most 0.2 ms.
void free_lines() {
  TWCR = 0;
  PORTC &= uint8_t(~(kSda | kScl));
  DDRC &= uint8_t(~(kSda | kScl));
  for (uint8_t clock = 0; clock < 9 && (PINC & kSda) == 0; ++clock) {
    DDRC |= kScl;
    _delay_us(5);
    DDRC &= uint8_t(~kScl);
    _delay_us(5);
  }
  DDRC |= kSda;  // STOP: SDA rises while SCL is high
  _delay_us(5);
  DDRC &= uint8_t(~kSda);
  _delay_us(5);
}

// Everything but the START; false while a transfer is under way.
bool prepare(uint8_t address, uint8_t* buffer, uint8_t out_size, uint8_t in_size) {
  if (hal::poll_transfer() == TransferStatus::kBusy) {
    return false;
  }
  // The STOP of the last transfer takes 2.5 us at most; START behind it waits in the hardware.
  g_buffer = buffer;
  g_address = address;
  g_out = out_size;
  g_in = in_size;
  g_at = 0;
  g_status = TransferStatus::kBusy;
  g_steps_seen = g_steps;
  g_begin_us = g_step_us = hal::now_us();
  return true;
}

}  // namespace

// About 3 us a byte, of 22.5 us on the wire; 139 cycles at most, seen in flight (tests/chip/imu).
ISR(TWI_vect) {
  ++g_steps;
  switch (TW_STATUS) {
    case TW_START:
    case TW_REP_START:
      TWDR = uint8_t(g_address << 1 | (g_out == 0 ? 1 : 0));
      TWCR = kGo;
      break;
    case TW_MT_SLA_ACK:
    case TW_MT_DATA_ACK:
      put_next();
      break;
    case TW_MR_SLA_ACK:
      ask_next();
      break;
    case TW_MR_DATA_ACK:
      take_byte();
      ask_next();
      break;
    case TW_MR_DATA_NACK:
      take_byte();
      end(TransferStatus::kDone);
      break;
    case TW_MT_SLA_NACK:
    case TW_MT_DATA_NACK:
    case TW_MR_SLA_NACK:
      end(TransferStatus::kNoAck);
      break;
    default:  // arbitration lost (there is no other master: a disturbance), bus error
      end(TransferStatus::kStuck);
      break;
  }
}

namespace hal {

void start_bus_master() {
  free_lines();
  TWSR = 0;
  TWBR = 12;  // 16 MHz / (16 + 2 * 12)
  TWCR = _BV(TWEN);
  g_status = TransferStatus::kDone;
}

bool begin_transfer(uint8_t address, uint8_t* buffer, uint8_t out_size, uint8_t in_size) {
  if (!prepare(address, buffer, out_size, in_size)) {
    return false;
  }
  TWCR = kGo | _BV(TWSTA);
  return true;
}

bool begin_transfer_at(uint32_t start_us, uint8_t address, uint8_t* buffer, uint8_t out_size) {
  if (!prepare(address, buffer, out_size, 0)) {
    return false;
  }
  // Half a turn of this loop, the call and the START itself: kStartUs on average (measured).
  const uint32_t go_us = start_us - kStartUs;
  while (int32_t(now_us() - go_us) < 0) {
  }
  TWCR = kGo | _BV(TWSTA);
  return true;
}

TransferStatus poll_transfer() {
  if (g_status != TransferStatus::kBusy) {
    return g_status;
  }
  const uint32_t at_us = now_us();
  const uint8_t steps = g_steps;
  if (steps != g_steps_seen) {
    g_steps_seen = steps;
    g_step_us = at_us;
  }
  if (at_us - g_step_us > kTransferStepUs || at_us - g_begin_us > kTransferTotalUs) {
    free_lines();
    TWCR = _BV(TWEN);
    g_status = TransferStatus::kStuck;
  }
  return g_status;
}

TransferStatus transfer(uint8_t address, uint8_t* buffer, uint8_t out_size, uint8_t in_size) {
  while (poll_transfer() == TransferStatus::kBusy) {
    sleep_until_interrupt();
  }
  begin_transfer(address, buffer, out_size, in_size);
  while (poll_transfer() == TransferStatus::kBusy) {
    sleep_until_interrupt();
  }
  avr::wake();  // something for the main loop may have ended these sleeps
  return poll_transfer();
}

}  // namespace hal
