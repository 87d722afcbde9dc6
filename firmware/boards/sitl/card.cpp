#include "boards/sitl/card.h"

#include <string.h>

#include <algorithm>

namespace sitl {

using hal::CardStatus;

void Card::insert(uint8_t* image, uint32_t blocks, const uint8_t* id) {
  *this = Card();
  image_ = image;
  blocks_ = blocks;
  memcpy(id_, id, sizeof id_);
}

void Card::add_event(const CardEvent& event) {
  const auto later = [](const CardEvent& a, const CardEvent& b) { return a.at < b.at; };
  const auto first = events_.begin() + static_cast<std::ptrdiff_t>(next_event_);
  events_.insert(std::upper_bound(first, events_.end(), event, later), event);
}

void Card::step(int64_t now) {
  if (pending_ && now >= busy_until_) commit();
  for (; next_event_ < events_.size() && events_[next_event_].at <= now; ++next_event_) {
    const CardEvent& event = events_[next_event_];
    switch (event.fault) {
      case CardFault::kBusy:
        next_busy_us_ = event.value;
        break;
      case CardFault::kReject:
        rejects_ = event.value;
        break;
      case CardFault::kRemove:
        cut(0);
        present_ = false;
        started_ = false;
        break;
      case CardFault::kInsert:
        present_ = true;
        break;
      case CardFault::kEveryBusy:
        every_busy_us_ = event.value;
        break;
      case CardFault::kUnreadable:
        unreadable_ = event.value != 0;
        break;
    }
  }
}

CardStatus Card::start(int64_t now) {
  step(now);
  if (!present()) return CardStatus::kAbsent;
  finish();
  started_ = true;
  streaming_ = false;
  return CardStatus::kOk;
}

CardStatus Card::read(uint32_t lba, uint8_t* block) const {
  if (!present() || !started_) return CardStatus::kAbsent;
  if (lba >= blocks_ || unreadable_) return CardStatus::kError;
  memcpy(block, image_ + static_cast<size_t>(lba) * hal::kCardBlockBytes, hal::kCardBlockBytes);
  return CardStatus::kOk;
}

CardStatus Card::write(uint32_t lba, const uint8_t* block, int64_t now, int64_t busy) {
  if (lba >= blocks_) return CardStatus::kError;
  const int64_t fault = 2 * static_cast<int64_t>(next_busy_us_);
  next_busy_us_ = 0;
  program(lba, block, now + (fault > 0 ? fault : busy));
  ++ground_writes_;
  return CardStatus::kOk;
}

void Card::program(uint32_t lba, const uint8_t* block, int64_t until) {
  memcpy(pending_block_, block, sizeof pending_block_);
  pending_lba_ = lba;
  pending_ = true;
  busy_until_ = until;
}

CardStatus Card::begin_stream(uint32_t lba, int64_t now) {
  step(now);
  if (!present() || !started_) return CardStatus::kAbsent;
  if (pending_) return CardStatus::kBusy;
  if (lba >= blocks_) return CardStatus::kError;
  streaming_ = true;
  stream_lba_ = lba;
  return CardStatus::kOk;
}

CardStatus Card::poll_stream(int64_t now) {
  step(now);
  if (!present() || !started_) return CardStatus::kAbsent;
  if (pending_) return CardStatus::kBusy;
  return CardStatus::kOk;
}

CardStatus Card::write_stream(const uint8_t* block, int64_t now) {
  step(now);
  if (!present() || !started_) return CardStatus::kAbsent;
  if (!streaming_ || pending_ || stream_lba_ >= blocks_) return CardStatus::kError;
  if (rejects_ > 0) {
    --rejects_;
    streaming_ = false;
    return CardStatus::kRejected;
  }
  const uint32_t busy_us = next_busy_us_ > 0 ? next_busy_us_ : every_busy_us_;
  next_busy_us_ = 0;
  program(stream_lba_++, block, now + 2 * static_cast<int64_t>(busy_us));
  ++blocks_taken_;
  return CardStatus::kOk;
}

void Card::end_stream() {
  streaming_ = false;
}

void Card::cut(uint32_t seed) {
  started_ = false;
  streaming_ = false;
  if (!pending_) return;
  // A torn block: its first part new, the rest noise; never the whole block.
  uint32_t noise = seed * 2654435761U + 1U;
  const uint32_t kept = noise % (hal::kCardBlockBytes - 1U);
  for (uint32_t i = kept; i < hal::kCardBlockBytes; ++i) {
    noise = noise * 1664525U + 1013904223U;
    pending_block_[i] = static_cast<uint8_t>(noise >> 24);
  }
  pending_block_[kept] ^= 0x55U;
  commit();
}

void Card::finish() {
  if (pending_) commit();
}

void Card::commit() {
  pending_ = false;
  const size_t offset = static_cast<size_t>(pending_lba_) * hal::kCardBlockBytes;
  memcpy(image_ + offset, pending_block_, sizeof pending_block_);
}

}  // namespace sitl
