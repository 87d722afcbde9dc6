// Where every frame goes: into the log while a session runs, to the radio as its budget allows, and
// the channels to USB while nothing is recorded.
#pragma once

#include <stdint.h>

#include "app/row_learning.h"
#include "app/telemetry.h"
#include "app/usb_channels.h"
#include "core/byte_ring.h"
#include "core/input_command.h"
#include "generated/frames.h"

namespace app {

class Outlet {
 public:
  Outlet(core::ByteRing& ring, Telemetry& telemetry) : ring_(ring), telemetry_(telemetry) {}

  // Frames that find no room are counted by the ring.
  template <typename Frame>
  void put(const Frame& frame) {
    ++frames_;
    if (logging_) (void)ring_.push(frame);
    (void)telemetry_.offer(Frame::id(), &frame, sizeof frame, frame.t_us);
  }

  // The row that begins, into the log: the radio takes no card.
  void put_row(const core::InputMemory& memory) {
    ++frames_;
    if (logging_) (void)ring_.push(frames::CardFrame::id(), &memory, memory.t_us);
  }

  // One envelope at most: the receiver must not wait for two.
  void put(const frames::IdentFrame& frame) {
    ++frames_;
    if (logging_) (void)ring_.push(frame);
    if (learning_ != nullptr) learning_->see(frame);
    const uint8_t id = frames::IdentFrame::id();
    if (telemetry_.offer(id, &frame, sizeof frame, frame.t_us)) return;
    if (!logging_) usb_.offer(frame);
  }

  // Into the log before all others: open() is to come.
  template <typename Frame>
  void put_head(const Frame& frame) {
    (void)ring_.push(frame);
    (void)telemetry_.offer(Frame::id(), &frame, sizeof frame, frame.t_us);
  }

  UsbChannels& usb() { return usb_; }
  uint8_t frames() const { return frames_; }  // put so far, and round again

  // Events of the time before a session wait for it. Of more than eight the first two stay, which
  // tell of the boot, and the oldest behind them is given up.
  // Apart: written out where it is called, its registers were saved in every turn.
  __attribute__((noinline)) void event(frames::Event code, uint32_t arg, uint32_t t_us) {
    const frames::EventFrame frame = send(code, arg, t_us);
    if (logging_) {
      (void)ring_.push_event(code, arg, t_us);
      return;
    }
    if (waiting_count_ == kWaiting) {
      for (uint8_t i = kBootEvents + 1; i < kWaiting; ++i) waiting_[i - 1] = waiting_[i];
      --waiting_count_;
    }
    waiting_[waiting_count_++] = frame;
  }

  // To the radio alone.
  frames::EventFrame send(frames::Event code, uint32_t arg, uint32_t t_us) {
    frames::EventFrame frame;
    frame.t_us = t_us;
    frame.code = static_cast<uint8_t>(code);
    frame.arg = arg;
    (void)telemetry_.offer(frames::EventFrame::id(), &frame, sizeof frame, t_us);
    return frame;
  }

  void open() { logging_ = true; }
  void release_waiting() {
    for (uint8_t i = 0; i < waiting_count_; ++i) {
      const frames::EventFrame& frame = waiting_[i];
      (void)ring_.push_event(static_cast<frames::Event>(frame.code), frame.arg, frame.t_us);
    }
    waiting_count_ = 0;
  }
  void close() { logging_ = false; }
  bool logging() const { return logging_; }
  uint8_t dropped() const { return static_cast<uint8_t>(ring_.dropped()); }  // and round again
  bool quiet() const { return ring_.free() > ring_.capacity() / 2; }  // room for what can wait

  // Who learns of the identification frames, while a row may be flown; else null.
  void teach(RowLearning* learning) { learning_ = learning; }

  // Events wait between sessions only, so in one their memory is lent to the test input: to be
  // asked for at each use, null while it is theirs.
  core::InputMemory* lend() { return logging_ && waiting_count_ == 0 ? &input_memory_ : nullptr; }

 private:
  static constexpr uint8_t kWaiting = 8;
  static constexpr uint8_t kBootEvents = 2;

  core::ByteRing& ring_;
  Telemetry& telemetry_;
  UsbChannels usb_;
  union {
    frames::EventFrame waiting_[kWaiting] = {};
    core::InputMemory input_memory_;
  };
  RowLearning* learning_ = nullptr;
  uint8_t waiting_count_ = 0;
  uint8_t frames_ = 0;
  bool logging_ = false;
};

}  // namespace app
