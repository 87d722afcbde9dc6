// Receives packets as a TWI slave at 42 and 27 (address mask), each byte by interrupt; counts every
// status; can be told to dawdle in its handler and to answer only so many bytes.
#include <util/twi.h>

#include "common.h"

volatile uint8_t bytes[128];
volatile uint8_t length;
volatile uint16_t packets, bus_errors, refused_bytes;
volatile uint8_t sla, last_sla;
volatile uint8_t dawdle, limit = 255;
volatile uint8_t status_seen[32];

ISR(TWI_vect) {
  const uint8_t status = TW_STATUS;
  status_seen[status >> 3]++;
  uint8_t next = _BV(TWINT) | _BV(TWEN) | _BV(TWIE) | _BV(TWEA);
  switch (status) {
    case TW_SR_SLA_ACK:
      sla = TWDR >> 1;
      length = 0;
      if (limit == 0) next &= (uint8_t)~_BV(TWEA);
      break;
    case TW_SR_DATA_ACK:
      bytes[length++ & 127] = TWDR;
      if (length >= limit) next &= (uint8_t)~_BV(TWEA);
      break;
    case TW_SR_DATA_NACK:
      refused_bytes++;
      break;
    case TW_SR_STOP:
      packets++;
      last_sla = sla;
      break;
    case TW_BUS_ERROR:
      bus_errors++;
      next |= _BV(TWSTO);
      break;
    default:
      break;
  }
  for (uint8_t i = dawdle; i; i--) __asm__ __volatile__("nop");
  TWCR = next;
}

int main(void) {
  TWAR = 42 << 1;
  TWAMR = 0x62;
  TWCR = _BV(TWEN) | _BV(TWEA) | _BV(TWIE);
  sei();
  finished = 1;
  for (;;) {
    PORTA ^= _BV(PA0);
  }
}
