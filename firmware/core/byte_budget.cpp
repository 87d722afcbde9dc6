#include "core/byte_budget.h"

namespace core {

void ByteBudget::start(uint32_t now_us, uint16_t rate_byteps) {
  last_us_ = now_us;
  rate_byteps_ = rate_byteps;
  saved_ = 0;
}

bool ByteBudget::take(uint16_t size, uint32_t now_us) {
  // In steps of 1/64 s, so that no division is needed and rounding never gives more.
  constexpr uint16_t kStepUs = 15625;
  constexpr uint8_t kSteps = 32;
  uint8_t steps = 0;
  while (steps < kSteps && now_us - last_us_ >= kStepUs) {
    last_us_ += kStepUs;
    ++steps;
  }
  if (steps == kSteps && now_us - last_us_ >= kStepUs) {
    last_us_ = now_us;
  }
  const uint32_t saved = saved_ + (static_cast<uint32_t>(rate_byteps_) * steps >> 6);
  const uint16_t most = rate_byteps_ / 2;
  saved_ = saved < most ? static_cast<uint16_t>(saved) : most;
  if (size > saved_) {
    return false;
  }
  saved_ = static_cast<uint16_t>(saved_ - size);
  return true;
}

}  // namespace core
