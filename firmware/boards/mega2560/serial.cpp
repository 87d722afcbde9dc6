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
  bool put(const uint8_t byte) {
    const uint8_t head = head_;
    const uint8_t next = after(head);
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
    tail_ = after(tail);
    return true;
  }

  uint8_t room() const {
    const uint8_t head = head_;
    const uint8_t tail = tail_;
    return uint8_t((head >= tail ? kSize - 1U : uint8_t{0} - 1U) - head + tail);
  }

 private:
  static uint8_t after(const uint8_t at) { return at == kSize - 1 ? 0 : uint8_t(at + 1U); }

  uint8_t bytes_[kSize];
  volatile uint8_t head_ = 0;
  volatile uint8_t tail_ = 0;
};

Fifo<52> g_usb_out;  // the longest part of the status line has 48
Fifo<32> g_gps_in;   // 8 ms at 38400 baud
Fifo<10> g_gps_out;
Fifo<96> g_radio_out;  // the longest envelope has 77
volatile uint16_t g_gps_lost;

// UBRR for double speed, rounded to the nearest rate; 111111 and 250000 come out exactly.
uint16_t divider(const uint32_t baud) {
  return uint16_t((F_CPU / 4 / baud - 1) / 2);
}

constexpr uint8_t kSends = _BV(TXEN0);
constexpr uint8_t kBoth = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);

}  // namespace

// Bit positions are the same for all USARTs of this chip. Both serve until their flag is clear, so
// that setting the enable bit again cannot enter them at once.
NESTING_ISR(USART2_RX_vect, UCSR2B, uint8_t(~_BV(RXCIE0))) {
  while ((UCSR2A & _BV(RXC0)) != 0) {
    const bool overrun = (UCSR2A & _BV(DOR0)) != 0;
    if (!g_gps_in.put(UDR2) || overrun) {
      g_gps_lost = uint16_t(g_gps_lost + 1U);
    }
  }
  UCSR2B |= _BV(RXCIE0);
}

#define SEND_INTERRUPT(n, fifo)                                          \
  NESTING_ISR(USART##n##_UDRE_vect, UCSR##n##B, uint8_t(~_BV(UDRIE0))) { \
    uint8_t byte;                                                        \
    while ((UCSR##n##A & _BV(UDRE0)) != 0) {                             \
      if (!fifo.take(&byte)) {                                           \
        return;                                                          \
      }                                                                  \
      UDR##n = byte;                                                     \
    }                                                                    \
    UCSR##n##B |= _BV(UDRIE0);                                           \
  }

SEND_INTERRUPT(0, g_usb_out)
SEND_INTERRUPT(2, g_gps_out)
SEND_INTERRUPT(3, g_radio_out)

namespace hal {

void open_port(const Port port, const uint32_t baud) {
  const uint16_t ubrr = divider(baud);
  switch (port) {
    case Port::kUsb:
      UCSR0A = _BV(U2X0);
      UBRR0 = ubrr;
      UCSR0B = kSends;
      break;
    case Port::kGps:
      UCSR2A = _BV(U2X0);
      UBRR2 = ubrr;
      UCSR2B = kBoth;
      break;
    case Port::kTelemetry:
      UCSR3A = _BV(U2X0);
      UBRR3 = ubrr;
      UCSR3B = kSends;
      break;
  }
}

bool take_byte(const Port port, uint8_t* const byte) {
  return port == Port::kGps && g_gps_in.take(byte);
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
  return port == Port::kGps ? g_gps_lost : uint16_t{0};
}

}  // namespace hal
