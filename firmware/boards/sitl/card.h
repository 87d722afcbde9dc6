// A memory card over an image that belongs to the caller.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include <vector>

#include "hal/block_device.h"

namespace sitl {

// What a card may do to its host, from a given time on.
enum class CardFault : uint8_t {
  kBusy = 0,    // the next block takes `value` us
  kReject = 1,  // the next `value` blocks are refused
  kRemove = 2,
  kInsert = 3,
  kEveryBusy = 4,   // every block from here on takes `value` us
  kUnreadable = 5,  // reads fail while `value` is not 0
};

struct CardEvent {
  int64_t at;
  CardFault fault;
  uint32_t value;
};

class Card {
 public:
  void insert(uint8_t* image, uint32_t blocks, const uint8_t* id);
  void add_event(const CardEvent& event);
  void step(int64_t now);

  hal::CardStatus start(int64_t now);
  hal::CardStatus read(uint32_t lba, uint8_t* block) const;
  // A single block, programmed for `busy` or as long as a fault says.
  hal::CardStatus write(uint32_t lba, const uint8_t* block, int64_t now, int64_t busy);
  hal::CardStatus begin_stream(uint32_t lba, int64_t now);
  hal::CardStatus poll_stream(int64_t now);
  hal::CardStatus write_stream(const uint8_t* block, int64_t now);
  void end_stream();

  // Power goes: a block being programmed is lost as garbage made from `seed`.
  void cut(uint32_t seed);
  // The host restarts, the card keeps its power: what it took, it writes.
  void finish();

  uint32_t blocks() const { return started_ ? blocks_ : 0; }
  const uint8_t* id() const { return id_; }
  bool present() const { return present_ && image_ != nullptr; }
  bool usable() const { return present() && started_; }
  bool programming() const { return pending_; }
  uint32_t blocks_taken() const { return blocks_taken_; }
  uint32_t ground_writes() const { return ground_writes_; }

 private:
  void program(uint32_t lba, const uint8_t* block, int64_t until);
  void commit();

  uint8_t* image_ = nullptr;
  uint32_t blocks_ = 0;
  uint8_t id_[hal::kCardIdBytes] = {};
  bool present_ = true;
  bool unreadable_ = false;
  bool started_ = false;
  bool streaming_ = false;
  bool pending_ = false;
  uint32_t stream_lba_ = 0;
  uint32_t pending_lba_ = 0;
  uint8_t pending_block_[hal::kCardBlockBytes] = {};
  int64_t busy_until_ = 0;
  uint32_t every_busy_us_ = 1000;
  uint32_t next_busy_us_ = 0;
  uint32_t rejects_ = 0;
  uint32_t blocks_taken_ = 0;
  uint32_t ground_writes_ = 0;
  std::vector<CardEvent> events_;
  size_t next_event_ = 0;
};

}  // namespace sitl
