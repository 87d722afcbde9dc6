#include "boards/arduimu/serial.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#include "boards/avr/usart.h"

namespace {

constexpr uint8_t kInSize = 64;   // 16 ms at 38400 baud
constexpr uint8_t kOutSize = 64;  // the longest message of drivers/ublox.h has 44 bytes

// One producer, one consumer, one-byte indices: no lock needed.
uint8_t g_in[kInSize];
volatile uint8_t g_in_head;
volatile uint8_t g_in_tail;
uint8_t g_out[kOutSize];
volatile uint8_t g_out_head;
volatile uint8_t g_out_tail;

}  // namespace

// 60 cycles at most, seen in flight (tests/simavr/imu).
ISR(USART_RX_vect) {
  const uint8_t byte = UDR0;
  const uint8_t head = g_in_head;
  const uint8_t next = (head + 1U) & (kInSize - 1U);
  if (next != g_in_tail) {
    g_in[head] = byte;
    g_in_head = next;
  }
}

ISR(USART_UDRE_vect) {
  const uint8_t tail = g_out_tail;
  if (tail == g_out_head) {
    UCSR0B &= uint8_t(~_BV(UDRIE0));
    return;
  }
  UDR0 = g_out[tail];
  g_out_tail = (tail + 1U) & (kOutSize - 1U);
}

namespace arduimu {

void SerialPort::set_baud(uint32_t baud) {
  UCSR0A = _BV(U2X0);
  UBRR0 = avr::usart_divider(baud);
  UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0) | _BV(UDRIE0);
}

bool SerialPort::send(const uint8_t* bytes, uint8_t size) {
  const uint8_t used = (g_out_head - g_out_tail) & (kOutSize - 1U);
  if (size > kOutSize - 1U - used) {
    return false;
  }
  uint8_t head = g_out_head;
  for (uint8_t i = 0; i < size; ++i) {
    g_out[head] = bytes[i];
    head = (head + 1U) & (kOutSize - 1U);
  }
  __asm__ __volatile__("" ::: "memory");
  g_out_head = head;
  UCSR0B |= _BV(UDRIE0);
  return true;
}

bool take_byte(uint8_t& byte) {
  const uint8_t tail = g_in_tail;
  if (tail == g_in_head) {
    return false;
  }
  byte = g_in[tail];
  __asm__ __volatile__("" ::: "memory");
  g_in_tail = (tail + 1U) & (kInSize - 1U);
  return true;
}

}  // namespace arduimu
