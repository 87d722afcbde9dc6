// The radio: frames in envelopes within the budget of the settings, each kind at a rate of its own.
#pragma once

#include <stdint.h>

#include "core/byte_budget.h"
#include "core/every.h"
#include "generated/frames.h"

namespace app {

class Telemetry {
 public:
  void start(const frames::ConfigFrame& config, uint32_t now_us);

  // Sends the frame if it is its turn; one that then finds no room or budget is counted as
  // dropped. True if it was sent. `size` is without the id.
  bool offer(uint8_t id, const void* fields, uint8_t size, uint32_t now_us);
  // The hash of the schema; true every 5 s, when config and identity are to be offered too.
  bool poll(uint32_t now_us);

  frames::Telemetry mode() const { return mode_; }
  uint16_t dropped() const { return dropped_; }
  // Takes the bytes of a whole row from the budget; false, and counted, if it does not allow them.
  bool reserve(uint16_t size, uint32_t now_us);

 private:
  bool send(uint8_t id, const void* fields, uint8_t size, uint32_t now_us);

  core::ByteBudget budget_;
  core::Every heads_;
  // Of the kinds with a rate, by id, in steps of 1.024 ms.
  static constexpr uint8_t kPaced = frames::kBaroId + 1;
  uint16_t last_ms_[kPaced] = {};
  uint16_t dropped_ = 0;
  frames::Telemetry mode_ = frames::Telemetry::kOff;
};

}  // namespace app
