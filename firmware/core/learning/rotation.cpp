#include "core/learning/rotation.h"

#include "core/progmem.h"

namespace core {
namespace {

constexpr uint16_t kQuarter = kTurnSteps / 4;

// 4096 sin(2 pi i / 512), i = 0 to 128.
constexpr int16_t kSine[kQuarter + 1] CORE_FLASH = {
    0,    50,   101,  151,  201,  251,  301,  351,  401,  451,  501,  551,  601,  651,  700,
    750,  799,  848,  897,  946,  995,  1044, 1092, 1141, 1189, 1237, 1285, 1332, 1380, 1427,
    1474, 1521, 1567, 1614, 1660, 1706, 1751, 1797, 1842, 1886, 1931, 1975, 2019, 2062, 2106,
    2149, 2191, 2234, 2276, 2317, 2359, 2399, 2440, 2480, 2520, 2559, 2598, 2637, 2675, 2713,
    2751, 2788, 2824, 2861, 2896, 2932, 2967, 3001, 3035, 3068, 3102, 3134, 3166, 3198, 3229,
    3260, 3290, 3320, 3349, 3378, 3406, 3433, 3461, 3487, 3513, 3539, 3564, 3588, 3612, 3636,
    3659, 3681, 3703, 3724, 3745, 3765, 3784, 3803, 3822, 3839, 3857, 3873, 3889, 3905, 3920,
    3934, 3948, 3961, 3973, 3985, 3996, 4007, 4017, 4027, 4036, 4044, 4052, 4059, 4065, 4071,
    4076, 4081, 4085, 4088, 4091, 4093, 4095, 4096, 4096};

}  // namespace

Rotation rotation(uint16_t step) {
  const uint16_t at = step & (kQuarter - 1);
  const int16_t rising = static_cast<int16_t>(flash_u16(&kSine[at]));
  const int16_t falling = static_cast<int16_t>(flash_u16(&kSine[kQuarter - at]));
  const bool odd = (step & kQuarter) != 0;
  const int16_t re = odd ? static_cast<int16_t>(-rising) : falling;
  const int16_t im = odd ? static_cast<int16_t>(-falling) : static_cast<int16_t>(-rising);
  if ((step & (2 * kQuarter)) == 0) {
    return {re, im};
  }
  return {static_cast<int16_t>(-re), static_cast<int16_t>(-im)};
}

}  // namespace core
