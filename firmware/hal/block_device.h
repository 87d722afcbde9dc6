// The memory card in 512-byte blocks: calls that wait, for the ground, and a stream that does not.
#pragma once

#include <stdint.h>

namespace hal {

constexpr uint16_t kCardBlockBytes = 512;
constexpr uint8_t kCardIdBytes = 16;

enum class CardStatus : uint8_t {
  kOk,
  kBusy,      // stream only: not now
  kRejected,  // the card refused the block; the stream has ended
  kError,     // the card answers, but not as it should
  kAbsent,    // no answer
};

// Called about every 0.1 ms while one of the waiting calls below waits, so that receiver, servos,
// sensors and watchdog are served. It must not use the card. Null: nothing is called.
using CardWait = void (*)(void* context);
void set_card_wait(CardWait wait, void* context);

// --- on the ground: each call waits, up to 1 s for start_card() and 0.5 s for the others ---
CardStatus start_card();
CardStatus read_card_id(uint8_t* id);  // the CID register, kCardIdBytes
uint32_t card_blocks();                // 0 before start_card()
CardStatus read_card(uint32_t lba, uint8_t* block);
CardStatus write_card(uint32_t lba, const uint8_t* block);

// --- the stream: no call waits for the card; the longest is a block on SPI, 0.9 ms ---
// Opens a multi-block write. kOk: poll until it is ready.
CardStatus begin_stream(uint32_t lba);
// kOk: takes a block now. kBusy: still writing. Else the stream has ended.
CardStatus poll_stream();
// The next block, in any portions: only after poll_stream() said kOk. 1.6 us a byte.
void open_block();
void put_block(const uint8_t* bytes, uint16_t size);  // 512 bytes in all
// kOk: accepted, the card is busy with it until poll_stream() says otherwise. Else nothing of it
// was written, and the stream has ended.
CardStatus close_block();
// Ends the stream; poll_stream() says kBusy until the card has finished.
void end_stream();

}  // namespace hal
