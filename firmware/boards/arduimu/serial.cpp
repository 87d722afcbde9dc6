// The UART: a GPS receiver in flight, the console on the ground.
#include "hal/serial.h"

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

// 60 cycles at most, seen in flight (tests/chip/imu).
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

namespace hal {

void open_port(Port, const uint32_t baud) {
  UCSR0A = _BV(U2X0);
  UBRR0 = avr::usart_divider(baud);
  UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0) | _BV(UDRIE0);
}

uint16_t send_room(Port) {
  const uint8_t used = (g_out_head - g_out_tail) & (kOutSize - 1U);
  return uint16_t(kOutSize - 1U - used);
}

void send_byte(Port, const uint8_t byte) {
  const uint8_t head = g_out_head;
  g_out[head] = byte;
  __asm__ __volatile__("" ::: "memory");
  g_out_head = (head + 1U) & (kOutSize - 1U);
  UCSR0B |= _BV(UDRIE0);
}

bool take_byte(Port, uint8_t* const byte) {
  const uint8_t tail = g_in_tail;
  if (tail == g_in_head) {
    return false;
  }
  *byte = g_in[tail];
  __asm__ __volatile__("" ::: "memory");
  g_in_tail = (tail + 1U) & (kInSize - 1U);
  return true;
}

}  // namespace hal
