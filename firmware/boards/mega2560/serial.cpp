// USART 0 (USB), 2 (GPS) and 3 (radio), each filled and emptied by nesting interrupts.
#include "hal/serial.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#include "boards/mega2560/interrupts.h"

namespace {

// One producer, one consumer, one-byte indices: no lock needed.
template <uint8_t kSize>
class Fifo {
 public:
  static_assert((kSize & (kSize - 1)) == 0 && kSize <= 128, "a power of two, at most 128");

  bool put(const uint8_t byte) {
    const uint8_t head = head_;
    const uint8_t next = (head + 1U) & (kSize - 1U);
    if (next == tail_) {
      return false;
    }
    bytes_[head] = byte;
    __asm__ __volatile__("" ::: "memory");
    head_ = next;
    return true;
  }

  bool take(uint8_t* const byte) {
    const uint8_t tail = tail_;
    if (tail == head_) {
      return false;
    }
    *byte = bytes_[tail];
    __asm__ __volatile__("" ::: "memory");
    tail_ = (tail + 1U) & (kSize - 1U);
    return true;
  }

  uint8_t room() const { return uint8_t(kSize - 1U - ((head_ - tail_) & (kSize - 1U))); }

 private:
  uint8_t bytes_[kSize];
  volatile uint8_t head_ = 0;
  volatile uint8_t tail_ = 0;
};

Fifo<16> g_usb_in;
Fifo<64> g_usb_out;
Fifo<64> g_gps_in;   // 16 ms at 38400 baud
Fifo<64> g_gps_out;  // the longest message of drivers/ublox.h has 44 bytes
Fifo<16> g_radio_in;
Fifo<128> g_radio_out;
volatile uint16_t g_lost[3];

// UBRR for double speed, rounded to the nearest rate; 111111 and 250000 come out exactly.
uint16_t divider(const uint32_t baud) {
  return uint16_t((F_CPU / 4 / baud - 1) / 2);
}

constexpr uint8_t kOn = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);

}  // namespace

// Bit positions are the same for all USARTs of this chip. Both serve until their flag is clear, so
// that setting the enable bit again cannot enter them at once.
#define PORT_INTERRUPTS(n, fifo_in, fifo_out, port)                                             \
  NESTING_ISR(USART##n##_RX_vect, UCSR##n##B, uint8_t(~_BV(RXCIE0))) {                          \
    while ((UCSR##n##A & _BV(RXC0)) != 0) {                                                     \
      const bool overrun = (UCSR##n##A & _BV(DOR0)) != 0;                                       \
      if (!fifo_in.put(UDR##n) || overrun) {                                                    \
        g_lost[static_cast<uint8_t>(port)] = uint16_t(g_lost[static_cast<uint8_t>(port)] + 1U); \
      }                                                                                         \
    }                                                                                           \
    UCSR##n##B |= _BV(RXCIE0);                                                                  \
  }                                                                                             \
  NESTING_ISR(USART##n##_UDRE_vect, UCSR##n##B, uint8_t(~_BV(UDRIE0))) {                        \
    uint8_t byte;                                                                               \
    while ((UCSR##n##A & _BV(UDRE0)) != 0) {                                                    \
      if (!fifo_out.take(&byte)) {                                                              \
        return;                                                                                 \
      }                                                                                         \
      UDR##n = byte;                                                                            \
    }                                                                                           \
    UCSR##n##B |= _BV(UDRIE0);                                                                  \
  }

PORT_INTERRUPTS(0, g_usb_in, g_usb_out, hal::Port::kUsb)
PORT_INTERRUPTS(2, g_gps_in, g_gps_out, hal::Port::kGps)
PORT_INTERRUPTS(3, g_radio_in, g_radio_out, hal::Port::kTelemetry)

namespace hal {

void open_port(const Port port, const uint32_t baud) {
  const uint16_t ubrr = divider(baud);
  switch (port) {
    case Port::kUsb:
      UCSR0A = _BV(U2X0);
      UBRR0 = ubrr;
      UCSR0B = kOn;
      break;
    case Port::kGps:
      UCSR2A = _BV(U2X0);
      UBRR2 = ubrr;
      UCSR2B = kOn;
      break;
    case Port::kTelemetry:
      UCSR3A = _BV(U2X0);
      UBRR3 = ubrr;
      UCSR3B = kOn;
      break;
  }
}

bool take_byte(const Port port, uint8_t* const byte) {
  switch (port) {
    case Port::kUsb:
      return g_usb_in.take(byte);
    case Port::kGps:
      return g_gps_in.take(byte);
    case Port::kTelemetry:
      return g_radio_in.take(byte);
  }
  return false;
}

uint16_t send_room(const Port port) {
  switch (port) {
    case Port::kUsb:
      return g_usb_out.room();
    case Port::kGps:
      return g_gps_out.room();
    case Port::kTelemetry:
      return g_radio_out.room();
  }
  return 0;
}

void send_byte(const Port port, const uint8_t byte) {
  switch (port) {
    case Port::kUsb: {
      g_usb_out.put(byte);
      const mega::InterruptsOff guard;
      UCSR0B |= _BV(UDRIE0);
      break;
    }
    case Port::kGps: {
      g_gps_out.put(byte);
      const mega::InterruptsOff guard;
      UCSR2B |= _BV(UDRIE0);
      break;
    }
    case Port::kTelemetry: {
      g_radio_out.put(byte);
      const mega::InterruptsOff guard;
      UCSR3B |= _BV(UDRIE0);
      break;
    }
  }
}

uint16_t lost_bytes(const Port port) {
  const mega::InterruptsOff guard;
  return g_lost[static_cast<uint8_t>(port)];
}

}  // namespace hal
