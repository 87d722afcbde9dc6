// USART 0 (USB), 2 (GPS) and 3 (radio), each filled and emptied by nesting interrupts.
#include "hal/serial.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#include "boards/avr/interrupts_off.h"
#include "boards/avr/usart.h"

namespace {

// One producer, one consumer, one-byte indices: no lock needed. The interrupts below are one side
// of each: kHead and kTail tell them where the indices are.
template <uint8_t kSize>
class Fifo {
 public:
  static constexpr uint8_t kBytes = kSize;
  static constexpr uint8_t kHead = kSize;
  static constexpr uint8_t kTail = kSize + 1;

  // Those for which there is room.
  void put(const uint8_t* bytes, uint8_t size) {
    uint8_t head = head_;
    for (; size != 0; --size) {
      const uint8_t next = after(head);
      if (next == tail_) {
        break;
      }
      bytes_[head] = *bytes++;
      head = next;
    }
    __asm__ __volatile__("" ::: "memory");
    head_ = head;
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

  volatile uint8_t bytes_[kSize];  // the compiler does not see what the assembly stores
  volatile uint8_t head_ = 0;
  volatile uint8_t tail_ = 0;
};

Fifo<74> g_usb_out;  // an ident in its envelope has 73, the longest part of the status line 48
Fifo<32> g_gps_in;   // 8 ms at 38400 baud
Fifo<10> g_gps_out;
Fifo<96> g_radio_out;  // the longest envelope has 77
volatile uint16_t g_gps_lost;

constexpr uint8_t kSends = _BV(TXEN0);
constexpr uint8_t kBoth = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);

}  // namespace

static_assert(sizeof g_gps_in == 34 && sizeof g_radio_out == 98, "bytes, head, tail: no gaps");

// In assembly: 66 cycles for a byte in instead of 111, 58 for a byte out instead of 99; there are
// 1200 and 2200 a second. The own enable bit goes off first (board.h), then interrupts on; at
// the end they are off for 20 cycles, so that setting the bit again enters only behind RETI.
// Bit positions are the same for all USARTs of this chip.
ISR(USART2_RX_vect, ISR_NAKED) {
  __asm__ __volatile__(
      "push r24 \n\t"
      "in r24, __SREG__ \n\t"
      "push r24 \n\t"
      "lds r24, %[control] \n\t"
      "andi r24, %[masked] \n\t"
      "sts %[control], r24 \n\t"
      "sei \n\t"
      "push r25 \n\t"
      "push r30 \n\t"
      "push r31 \n\t"
      "lds r25, %[status] \n\t"
      "sbrc r25, %[overrun] \n\t"
      "rjmp 4f \n\t"
      "1: lds r25, %[data] \n\t"
      "lds r30, %[fifo]+%[head] \n\t"
      "mov r24, r30 \n\t"
      "inc r24 \n\t"
      "cpi r24, %[size] \n\t"
      "brne 2f \n\t"
      "ldi r24, 0 \n\t"
      "2: lds r31, %[fifo]+%[tail] \n\t"
      "cp r24, r31 \n\t"
      "breq 5f \n\t"
      "ldi r31, 0 \n\t"
      "subi r30, lo8(-(%[fifo])) \n\t"
      "sbci r31, hi8(-(%[fifo])) \n\t"
      "st Z, r25 \n\t"
      "sts %[fifo]+%[head], r24 \n\t"
      "3: pop r31 \n\t"
      "pop r30 \n\t"
      "pop r25 \n\t"
      "cli \n\t"
      "lds r24, %[control] \n\t"
      "ori r24, %[enable] \n\t"
      "sts %[control], r24 \n\t"
      "pop r24 \n\t"
      "out __SREG__, r24 \n\t"
      "pop r24 \n\t"
      "reti \n\t"
      // the chip had no room for the byte before this one
      "4: lds r30, %[lost] \n\t"
      "lds r31, %[lost]+1 \n\t"
      "adiw r30, 1 \n\t"
      "sts %[lost], r30 \n\t"
      "sts %[lost]+1, r31 \n\t"
      "rjmp 1b \n\t"
      // full
      "5: lds r30, %[lost] \n\t"
      "lds r31, %[lost]+1 \n\t"
      "adiw r30, 1 \n\t"
      "sts %[lost], r30 \n\t"
      "sts %[lost]+1, r31 \n\t"
      "rjmp 3b \n\t" ::[control] "n"(_SFR_MEM_ADDR(UCSR2B)),
      [status] "n"(_SFR_MEM_ADDR(UCSR2A)),
      [data] "n"(_SFR_MEM_ADDR(UDR2)),
      [masked] "M"(0xFF & ~_BV(RXCIE0)),
      [enable] "M"(_BV(RXCIE0)),
      [overrun] "I"(DOR0),
      [fifo] "i"(&g_gps_in),
      [size] "M"(decltype(g_gps_in)::kBytes),
      [head] "n"(decltype(g_gps_in)::kHead),
      [tail] "n"(decltype(g_gps_in)::kTail),
      [lost] "i"(&g_gps_lost));
}

// An empty fifo leaves its interrupt off; send_byte() turns it on.
#define SEND_INTERRUPT(n, fifo_of)                              \
  ISR(USART##n##_UDRE_vect, ISR_NAKED) {                        \
    __asm__ __volatile__(                                       \
        "push r24 \n\t"                                         \
        "in r24, __SREG__ \n\t"                                 \
        "push r24 \n\t"                                         \
        "lds r24, %[control] \n\t"                              \
        "andi r24, %[masked] \n\t"                              \
        "sts %[control], r24 \n\t"                              \
        "sei \n\t"                                              \
        "push r30 \n\t"                                         \
        "push r31 \n\t"                                         \
        "lds r30, %[fifo]+%[tail] \n\t"                         \
        "lds r24, %[fifo]+%[head] \n\t"                         \
        "cp r24, r30 \n\t"                                      \
        "breq 2f \n\t"                                          \
        "mov r24, r30 \n\t"                                     \
        "ldi r31, 0 \n\t"                                       \
        "subi r30, lo8(-(%[fifo])) \n\t"                        \
        "sbci r31, hi8(-(%[fifo])) \n\t"                        \
        "ld r31, Z \n\t"                                        \
        "sts %[data], r31 \n\t"                                 \
        "inc r24 \n\t"                                          \
        "cpi r24, %[size] \n\t"                                 \
        "brne 1f \n\t"                                          \
        "ldi r24, 0 \n\t"                                       \
        "1: sts %[fifo]+%[tail], r24 \n\t"                      \
        "pop r31 \n\t"                                          \
        "pop r30 \n\t"                                          \
        "cli \n\t"                                              \
        "lds r24, %[control] \n\t"                              \
        "ori r24, %[enable] \n\t"                               \
        "sts %[control], r24 \n\t"                              \
        "pop r24 \n\t"                                          \
        "out __SREG__, r24 \n\t"                                \
        "pop r24 \n\t"                                          \
        "reti \n\t"                                             \
        "2: pop r31 \n\t"                                       \
        "pop r30 \n\t"                                          \
        "pop r24 \n\t"                                          \
        "out __SREG__, r24 \n\t"                                \
        "pop r24 \n\t"                                          \
        "reti \n\t" ::[control] "n"(_SFR_MEM_ADDR(UCSR##n##B)), \
        [data] "n"(_SFR_MEM_ADDR(UDR##n)),                      \
        [masked] "M"(0xFF & ~_BV(UDRIE0)),                      \
        [enable] "M"(_BV(UDRIE0)),                              \
        [fifo] "i"(&fifo_of),                                   \
        [size] "M"(decltype(fifo_of)::kBytes),                  \
        [head] "n"(decltype(fifo_of)::kHead),                   \
        [tail] "n"(decltype(fifo_of)::kTail));                  \
  }

SEND_INTERRUPT(0, g_usb_out)
SEND_INTERRUPT(2, g_gps_out)
SEND_INTERRUPT(3, g_radio_out)

namespace hal {

void open_port(const Port port, const uint32_t baud) {
  const uint16_t ubrr = avr::usart_divider(baud);
  switch (port) {
    case Port::kUsb:
      UCSR0A = _BV(U2X0);
      UBRR0 = ubrr;
      UCSR0B = kSends | _BV(RXEN0);
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

// USB has no interrupt and no buffer but the chip's two bytes: its peer waits behind each byte for
// an answer (app/card_console.h).
bool take_byte(const Port port, uint8_t* const byte) {
  if (port == Port::kUsb && (UCSR0A & _BV(RXC0)) != 0) {
    *byte = UDR0;
    return true;
  }
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
  send_bytes(port, &byte, 1);
}

void send_bytes(const Port port, const uint8_t* const bytes, const uint8_t size) {
  switch (port) {
    case Port::kUsb: {
      g_usb_out.put(bytes, size);
      const avr::InterruptsOff guard;
      UCSR0B |= _BV(UDRIE0);
      break;
    }
    case Port::kGps: {
      g_gps_out.put(bytes, size);
      const avr::InterruptsOff guard;
      UCSR2B |= _BV(UDRIE0);
      break;
    }
    case Port::kTelemetry: {
      g_radio_out.put(bytes, size);
      const avr::InterruptsOff guard;
      UCSR3B |= _BV(UDRIE0);
      break;
    }
  }
}

uint16_t lost_bytes(const Port port) {
  const avr::InterruptsOff guard;
  return port == Port::kGps ? g_gps_lost : uint16_t{0};
}

}  // namespace hal
