#include "app/card_stream.h"

#include "hal/clock.h"

namespace app {

using hal::CardStatus;

namespace {

constexpr uint32_t kDeadUs = 2000000UL;  // no card is busy that long
constexpr uint32_t kStallUs = 100000UL;  // worth an event
constexpr uint16_t kPortion = 64;        // bytes of a block per turn: 0.3 ms with its CRCs
constexpr uint8_t kMostRejects = 4;      // in a row

}  // namespace

void CardStream::start(uint32_t first_lba) {
  first_lba_ = first_lba;
  rejects_ = 0;
  open_ = false;
  block_open_ = false;
  programming_ = false;
}

CardStatus CardStream::step(uint32_t now_us) {
  if (block_open_) return next_block(now_us);
  if (!open_) return writer_.due(now_us) ? open(now_us) : CardStatus::kOk;
  // It has been idle since the last block, and is asked again for the next.
  if (!programming_ && !writer_.due(now_us)) {
    busy_from_us_ = now_us;
    tell_stall(now_us);
    return CardStatus::kOk;
  }
  switch (hal::poll_stream()) {
    case CardStatus::kBusy:
      return now_us - busy_from_us_ >= kDeadUs ? failed(CardStatus::kBusy) : CardStatus::kOk;
    case CardStatus::kOk:
      note_busy(now_us);
      busy_from_us_ = now_us;
      if (!writer_.due(now_us)) {
        tell_stall(now_us);
        return CardStatus::kOk;
      }
      hal::open_block();
      block_open_ = true;
      return next_block(now_us);
    case CardStatus::kAbsent:
      return failed(CardStatus::kAbsent);
    case CardStatus::kRejected:
    case CardStatus::kError:
      break;
  }
  return failed(CardStatus::kError);
}

CardStatus CardStream::open(uint32_t now_us) {
  const CardStatus status = hal::begin_stream(first_lba_ + writer_.sequence());
  if (status == CardStatus::kBusy) return CardStatus::kOk;
  if (status != CardStatus::kOk) return failed(status);
  open_ = true;
  busy_from_us_ = now_us;
  return CardStatus::kOk;
}

CardStatus CardStream::next_block(uint32_t now_us) {
  Sink sink;
  if (!writer_.stream(sink, kPortion)) return CardStatus::kOk;
  block_open_ = false;
  return close_block(now_us);
}

CardStatus CardStream::close_block(uint32_t now_us) {
  const CardStatus status = hal::close_block();
  if (status == CardStatus::kOk) {
    writer_.accepted();
    rejects_ = 0;
    programming_ = true;
    busy_from_us_ = hal::now_us();
    tell_stall(now_us);
    return CardStatus::kOk;
  }
  open_ = false;
  if (status == CardStatus::kAbsent) return failed(status);
  count_error();
  if (++rejects_ > kMostRejects) return failed(status);
  if (rejects_ == 1) {
    writer_.rejected();
  } else {
    outlet_.event(frames::Event::kBlockSkipped, writer_.sequence(), now_us);
    writer_.skip();
  }
  return CardStatus::kOk;
}

CardStatus CardStream::failed(CardStatus why) {
  count_error();
  open_ = false;
  block_open_ = false;
  programming_ = false;
  return why;
}

void CardStream::count_error() {
  if (errors_ != 0xFFFFU) ++errors_;
}

void CardStream::note_busy(uint32_t now_us) {
  if (!programming_) return;
  programming_ = false;
  const uint32_t busy_us = now_us - busy_from_us_;
  const uint32_t busy_ms = busy_us / 1000U;
  if (busy_ms > busy_max_ms_) busy_max_ms_ = static_cast<uint16_t>(busy_ms);
  if (busy_us >= kStallUs) stall_ms_ = static_cast<uint16_t>(busy_ms > 0xFFFFU ? 0xFFFFU : busy_ms);
}

// After the block that makes room: an event pushed into the reserve of a full ring would tell of
// the frames dropped so far, with more to come.
void CardStream::tell_stall(uint32_t now_us) {
  if (stall_ms_ == 0) return;
  outlet_.event(frames::Event::kCardStall, stall_ms_, now_us);
  stall_ms_ = 0;
}

bool CardStream::ended(uint32_t now_us) {
  if (open_) {
    hal::end_stream();
    open_ = false;
    closing_ = true;
    busy_from_us_ = hal::now_us();
    return false;
  }
  if (!closing_) return true;
  if (hal::poll_stream() == CardStatus::kBusy && now_us - busy_from_us_ < kDeadUs) return false;
  closing_ = false;
  return true;
}

void CardStream::put_health(frames::SystemFrame* out) {
  out->card_busy_max_ms = busy_max_ms_;
  out->card_errors = errors_;
  busy_max_ms_ = 0;
}

}  // namespace app
