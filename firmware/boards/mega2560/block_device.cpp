// The card on the hardware SPI.
#include "hal/block_device.h"

#include <avr/io.h>
#include <string.h>

#include "boards/avr/spi.h"
#include "boards/mega2560/generated/pins.h"
#include "drivers/sd_card.h"
#include "hal/clock.h"

namespace {

class Spi {
 public:
  static uint8_t transfer(const uint8_t byte) {
    finish();
    SPDR = byte;
    return avr::spi_ended(polls_) ? SPDR : kNoCard;
  }
  // Returns while the byte is shifted out: 16 cycles at 8 MHz, in which a CRC step fits.
  static void send(const uint8_t byte) {
    finish();
    SPDR = byte;
    shifting_ = true;
  }
  // 40 cycles a byte, which is more than a byte is shifted for: none waits for the one before it,
  // and the status is read only because that clears the flag. One loop for each CRC and one for
  // the bus took 62.
  static uint32_t send_all(const uint8_t* bytes,
                           uint16_t size,
                           uint16_t& crc16_state,
                           uint32_t crc32) {
    if (size == 0) {
      return crc32;
    }
    uint16_t crc16 = crc16_state;
    uint8_t byte;
    finish();
    __asm__ __volatile__(
        "1: ld %[byte], X+ \n\t"
        "in r30, %[status] \n\t"
        "out %[data], %[byte] \n\t"
        "eor %A[crc32], %[byte] \n\t"
        "mov r30, %A[crc32] \n\t"
        "ldi r31, hi8(%[pages]) \n\t"
        "lpm %A[crc32], Z \n\t"
        "eor %A[crc32], %B[crc32] \n\t"
        "inc r31 \n\t"
        "lpm %B[crc32], Z \n\t"
        "eor %B[crc32], %C[crc32] \n\t"
        "inc r31 \n\t"
        "lpm %C[crc32], Z \n\t"
        "eor %C[crc32], %D[crc32] \n\t"
        "inc r31 \n\t"
        "lpm %D[crc32], Z \n\t"
        "mov r30, %B[crc16] \n\t"
        "eor r30, %[byte] \n\t"
        "inc r31 \n\t"
        "lpm %B[crc16], Z \n\t"
        "eor %B[crc16], %A[crc16] \n\t"
        "inc r31 \n\t"
        "lpm %A[crc16], Z \n\t"
        "sbiw %[size], 1 \n\t"
        "brne 1b \n\t"
        : [crc32] "+r"(crc32),
          [crc16] "+r"(crc16),
          [bytes] "+x"(bytes),
          [size] "+w"(size),
          [byte] "=&r"(byte)
        : [pages] "i"(&core::kCrcPages),
          [status] "I"(_SFR_IO_ADDR(SPSR)),
          [data] "I"(_SFR_IO_ADDR(SPDR))
        : "r30", "r31", "memory");
    shifting_ = true;
    crc16_state = crc16;
    return crc32;
  }
  static void ask() {
    finish();
    SPDR = 0xFF;
  }
  static uint8_t next() {
    const uint8_t byte = last();
    SPDR = 0xFF;
    return byte;
  }
  static uint8_t last() { return avr::spi_ended(polls_) ? SPDR : kNoCard; }
  static void select() {
    start();
    finish();
    pins::CardCs::port() &= uint8_t(~pins::CardCs::kMask);
  }
  static void deselect() {
    start();
    finish();
    pins::CardCs::port() |= pins::CardCs::kMask;
  }
  static void slow() {
    start();
    SPCR = _BV(SPE) | _BV(MSTR) | _BV(SPR1);  // 16 MHz / 64 = 250 kHz
    SPSR = 0;
    polls_ = 120;  // a byte: 512 cycles
  }
  static void fast() {
    SPCR = _BV(SPE) | _BV(MSTR);
    SPSR = _BV(SPI2X);  // 16 MHz / 2
    polls_ = 12;        // a byte: 16 cycles
  }
  static uint32_t now_us() { return hal::now_us(); }

 private:
  static void finish() {
    if (shifting_) {
      avr::spi_ended(polls_);
      shifting_ = false;
    }
  }
  // SS must be an output before the SPI is a master, else a low level makes it a slave.
  static void start() {
    if ((pins::CardCs::direction() & pins::CardCs::kMask) == 0) {
      pins::CardCs::port() |= pins::CardCs::kMask;
      pins::CardCs::direction() |= pins::CardCs::kMask;
      pins::CardSck::direction() |= pins::CardSck::kMask;
      pins::CardMosi::direction() |= pins::CardMosi::kMask;
      pins::CardMiso::port() |= pins::CardMiso::kMask;  // no card reads as kNoCard
    }
  }

  static constexpr uint8_t kNoCard = 0xFF;

  static bool shifting_;
  static uint8_t polls_;
};

bool Spi::shifting_ = false;
uint8_t Spi::polls_ = 0;

Spi g_spi;
drivers::SdCard<Spi> g_card(g_spi);
bool g_closing = false;

hal::CardStatus failure() {
  switch (g_card.status()) {
    case drivers::CardStatus::kNoCard:
    case drivers::CardStatus::kNoResponse:
      return hal::CardStatus::kAbsent;
    default:
      return hal::CardStatus::kError;
  }
}

hal::CardStatus result_of(const drivers::CardStep step) {
  switch (step) {
    case drivers::CardStep::kAgain:
      return hal::CardStatus::kBusy;
    case drivers::CardStep::kDone:
      return hal::CardStatus::kOk;
    case drivers::CardStep::kFailed:
      break;
  }
  return failure();
}

}  // namespace

namespace hal {

void start_card() {
  g_closing = false;
  g_card.start();
}

CardStatus poll_start() {
  if (g_card.poll()) {
    return CardStatus::kBusy;
  }
  return g_card.initialised() ? CardStatus::kOk : failure();
}

CardStatus read_card_id(uint8_t* const id) {
  if (!g_card.initialised()) {
    return CardStatus::kAbsent;
  }
  memcpy(id, g_card.cid(), kCardIdBytes);
  return CardStatus::kOk;
}

uint32_t card_blocks() {
  return g_card.initialised() ? g_card.sectors() : 0;
}

void begin_read(const uint32_t lba) {
  g_card.begin_block_at(lba);
}

CardStatus poll_read(uint8_t* const block) {
  return result_of(g_card.read(block));
}

void begin_write(const uint32_t lba) {
  g_card.begin_block_at(lba);
}

CardStatus poll_write(const uint8_t* const block) {
  return result_of(g_card.write(block));
}

CardStatus begin_stream(const uint32_t lba) {
  if (!g_card.initialised()) {
    return CardStatus::kAbsent;
  }
  g_closing = false;
  g_card.open_stream(lba);
  return CardStatus::kOk;
}

CardStatus poll_stream() {
  if (g_closing) {
    g_closing = g_card.closing();
    return g_closing ? CardStatus::kBusy : CardStatus::kOk;
  }
  if (g_card.ready()) {
    return CardStatus::kOk;
  }
  return g_card.status() == drivers::CardStatus::kOk ? CardStatus::kBusy : failure();
}

void open_block() {
  g_card.begin_block();
}

uint32_t put_block(const uint8_t* const bytes, const uint16_t size, const uint32_t crc32) {
  return g_card.put(bytes, size, crc32);
}

CardStatus close_block() {
  switch (g_card.end_block()) {
    case drivers::CardWrite::kAccepted:
      return CardStatus::kOk;
    case drivers::CardWrite::kRejected:
      return CardStatus::kRejected;
    case drivers::CardWrite::kGone:
      break;
  }
  return CardStatus::kAbsent;
}

void end_stream() {
  g_card.close_stream();
  g_closing = true;
}

}  // namespace hal
