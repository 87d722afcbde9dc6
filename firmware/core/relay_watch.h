// The relay's sense contact against what the heartbeat asks for: engaged within 50 ms of the first
// edge, and never open for 20 ms while edges are made. A contact that bounces (1 ms at most,
// hw/relay.md) is never open for so long. The Mega that does not drive must know it: its pulses
// reach nobody.
#pragma once

#include <stdint.h>

namespace core {

// Argument of the event `relay_lost`.
enum class RelayFault : uint8_t { kNeverEngaged = 0, kOpened = 1, kNone = 0xFF };

class RelayWatch {
 public:
  static constexpr uint32_t kEngageUs = 50000;
  static constexpr uint32_t kOpenUs = 20000;
  static constexpr uint32_t kBlindUs =
      10000;  // looks further apart say nothing of the time between

  // Every turn of the main loop while the Mega is to drive and has made an edge. One answer other
  // than kNone, and the caller stops making edges.
  RelayFault look(bool contact_closed, uint32_t now_us) {
    const bool blind = !watching_ || now_us - looked_us_ > kBlindUs;
    looked_us_ = now_us;
    if (!watching_) {
      watching_ = true;
      engaged_ = false;
      since_us_ = now_us;
    }
    if (contact_closed) {
      engaged_ = true;
      open_ = false;
      return RelayFault::kNone;
    }
    if (!engaged_) {
      return now_us - since_us_ >= kEngageUs ? RelayFault::kNeverEngaged : RelayFault::kNone;
    }
    if (!open_ || blind) {
      open_ = true;
      since_us_ = now_us;
    }
    return now_us - since_us_ >= kOpenUs ? RelayFault::kOpened : RelayFault::kNone;
  }
  // The Mega is not to drive: whatever the contact says now is right.
  void rest() { watching_ = false; }

 private:
  uint32_t since_us_ = 0;  // the first edge, or the contact was seen open
  uint32_t looked_us_ = 0;
  bool watching_ = false;
  bool engaged_ = false;  // the contact was closed since the first edge
  bool open_ = false;
};

}  // namespace core
