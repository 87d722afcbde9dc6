// How much the radio may be given: `rate` bytes per second, at most half a second saved up.
#pragma once

#include <stdint.h>

namespace core {

class ByteBudget {
 public:
  void start(uint32_t now_us, uint16_t rate_byteps);
  // True and spent, or false and nothing spent.
  bool take(uint16_t size, uint32_t now_us);

 private:
  uint32_t last_us_ = 0;
  uint16_t rate_byteps_ = 0;
  uint16_t saved_ = 0;
};

}  // namespace core
