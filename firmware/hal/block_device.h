// The memory card in 512-byte blocks: single blocks and a stream. No call waits for the card; none
// takes longer than 1 ms.
#pragma once

#include <stdint.h>

namespace hal {

constexpr uint16_t kCardBlockBytes = 512;
constexpr uint8_t kCardIdBytes = 16;

enum class CardStatus : uint8_t {
  kOk,
  kBusy,      // not now: ask again
  kRejected,  // the card refused the block; the stream has ended
  kError,     // the card answers, but not as it should
  kAbsent,    // no answer
};

// --- one thing at a time: each goes on by its poll until that says something else than kBusy ---
void start_card();
CardStatus poll_start();
void begin_read(uint32_t lba);
CardStatus poll_read(uint8_t* block);
void begin_write(uint32_t lba);
CardStatus poll_write(const uint8_t* block);

CardStatus read_card_id(uint8_t* id);  // the CID register, kCardIdBytes
uint32_t card_blocks();                // 0 until the card has started

// --- the stream ---
// Opens a multi-block write. kOk: poll until it is ready.
CardStatus begin_stream(uint32_t lba);
// kOk: takes a block now. kBusy: still writing. Else the stream has ended.
CardStatus poll_stream();
// The next block, in any portions, 512 bytes in all: only after poll_stream() said kOk. 2.5 us a
// byte, in which it is added to a CRC-32 (zlib's, not yet inverted): the state before and behind.
void open_block();
uint32_t put_block(const uint8_t* bytes, uint16_t size, uint32_t crc32);
// kOk: accepted, the card is busy with it until poll_stream() says otherwise. Else nothing of it
// was written, and the stream has ended.
CardStatus close_block();
// Ends the stream; poll_stream() says kBusy until the card has finished.
void end_stream();

}  // namespace hal
