// Bounds what an edge storm on the receiver pins may cost. A receiver makes at most 10 edges in
// a millisecond; at the 25th the interrupt masks its bank, for 20 ms.
#pragma once

#include <stdint.h>

namespace core {

class StormGuard {
 public:
  static constexpr uint8_t kMaxEdgesPerMs = 24;
  static constexpr uint8_t kMaskedMs = 20;

  // In the interrupt, for every edge. False: mask the bank now.
  bool edge() {
    ++edges_;
    return edges_ <= kMaxEdgesPerMs;
  }
  // Every millisecond, with the interrupt of edge() kept out. True: unmask the bank.
  bool tick() {
    if (edges_ <= kMaxEdgesPerMs) {
      edges_ = 0;
      return false;
    }
    if (++masked_ms_ < kMaskedMs) {
      return false;
    }
    masked_ms_ = 0;
    edges_ = 0;
    return true;
  }
  bool masked() const { return edges_ > kMaxEdgesPerMs; }

 private:
  volatile uint8_t edges_ = 0;
  uint8_t masked_ms_ = 0;
};

}  // namespace core
