#include "core/test_input.h"

#include "core/progmem.h"

namespace core {
namespace {

using frames::CardShape;

constexpr uint16_t kQuarter = 16384;
constexpr uint8_t kStepBits = 8;
constexpr int8_t kSweepScale = 64;  // 16384 becomes 65536 * 16, as scaled() takes it
constexpr uint8_t kTicks = 2;       // per us

// round(16384 * sin(pi / 2 * i / 64))
// clang-format off
constexpr int16_t kQuarterSine[65] CORE_FLASH = {
    0, 402, 804, 1205, 1606, 2006, 2404, 2801, 3196, 3590, 3981, 4370,
    4756, 5139, 5520, 5897, 6270, 6639, 7005, 7366, 7723, 8076, 8423, 8765,
    9102, 9434, 9760, 10080, 10394, 10702, 11003, 11297, 11585, 11866, 12140, 12406,
    12665, 12916, 13160, 13395, 13623, 13842, 14053, 14256, 14449, 14635, 14811, 14978,
    15137, 15286, 15426, 15557, 15679, 15791, 15893, 15986, 16069, 16143, 16207, 16261,
    16305, 16340, 16364, 16379, 16384,
};
// clang-format on

int16_t quarter(uint8_t index) {
  return static_cast<int16_t>(flash_u16(reinterpret_cast<const uint16_t*>(&kQuarterSine[index])));
}

// value * amplitude / 65536, towards zero, within the amplitude: by its size, as a division by a
// power of two of a signed number is one on the AVR.
int16_t scaled(int32_t value, int16_t amplitude) {
  const bool down = (value < 0) != (amplitude < 0);
  const uint16_t most = static_cast<uint16_t>(amplitude < 0 ? -amplitude : amplitude);
  const uint32_t size = static_cast<uint32_t>(value < 0 ? -value : value) >> 4;
  uint16_t ticks = static_cast<uint16_t>(size * most >> 16);
  if (ticks > most) ticks = most;
  return static_cast<int16_t>(down ? -static_cast<int16_t>(ticks) : static_cast<int16_t>(ticks));
}

// Which way the 3-2-1-1 points.
bool up_in_3211(uint32_t t_ms, uint32_t duration_ms) {
  const uint32_t sevenths = 7U * t_ms;
  if (sevenths < 3U * duration_ms) return true;
  return sevenths >= 5U * duration_ms && sevenths < 6U * duration_ms;
}

// Phase of the sweep in 1/65536 turns: the integral of a frequency that changes evenly, in steps
// of 0.01 Hz times 1/16 ms.
uint16_t sweep_phase(const CardRow& row, uint32_t t_ms) {
  const uint32_t bent = 8U * t_ms * t_ms / row.duration_ms;
  uint32_t n = 16U * t_ms * row.first_chz;
  if (row.last_chz >= row.first_chz) {
    n += static_cast<uint32_t>(row.last_chz - row.first_chz) * bent;
  } else {
    n -= static_cast<uint32_t>(row.first_chz - row.last_chz) * bent;
  }
  return static_cast<uint16_t>(n % 1600000U * 2048U / 50000U);
}

// Upper half of turns * harmonic, from products of 8 bits: the chip has no longer ones.
uint16_t times_upper(uint32_t turns, uint8_t harmonic) {
  const uint8_t low = static_cast<uint8_t>(turns);
  const uint8_t next = static_cast<uint8_t>(turns >> 8U);
  const uint16_t carry = static_cast<uint16_t>(static_cast<uint16_t>(next * harmonic) +
                                               (static_cast<uint16_t>(low * harmonic) >> 8U));
  // Of next * harmonic + carry all 16 bits are used: 255 * 255 + 254 fits.
  const uint16_t upper = static_cast<uint16_t>(turns >> 16U);
  return static_cast<uint16_t>(static_cast<uint16_t>(upper * harmonic) + (carry >> 8U));
}

// All axes in one pass: each component is one axis's.
void multisine(const CardRow& row, uint32_t turns, uint16_t t_ms, int16_t* ticks) {
  const uint32_t base = turns * t_ms;
  int32_t sums[kCardAxes] = {};
  for (uint8_t i = 0; i < sizeof row.components && row.components[i] != 0;
       i = static_cast<uint8_t>(i + 3U)) {
    const uint8_t share = row.components[i + 2];
    const uint8_t axis = static_cast<uint8_t>(share >> 6);
    if (axis >= kCardAxes) continue;
    const uint16_t turned = times_upper(base, row.components[i]);
    const int16_t sine = sin14(static_cast<uint16_t>(turned + (row.components[i + 1] << 8U)));
    sums[axis] += static_cast<int32_t>(sine) * static_cast<int16_t>(share & 0x3F);
  }
  for (uint8_t axis = 0; axis < kCardAxes; ++axis) ticks[axis] = scaled(sums[axis], ticks[axis]);
}

}  // namespace

int16_t sin14(uint16_t phase) {
  uint16_t within = phase & (kQuarter - 1U);
  if ((phase & kQuarter) != 0) within = static_cast<uint16_t>(kQuarter - within);
  const uint8_t index = static_cast<uint8_t>(within >> kStepBits);
  int16_t value = quarter(index);
  const uint8_t rest = static_cast<uint8_t>(within & 0xFFU);
  if (rest != 0) {
    // A step is at most 402: its upper byte is 0 or 1, and products of 8 bits are enough.
    const uint16_t step = static_cast<uint16_t>(quarter(static_cast<uint8_t>(index + 1U)) - value);
    const uint16_t part = static_cast<uint16_t>(static_cast<uint8_t>(step) * rest) >> kStepBits;
    value = static_cast<int16_t>(value + static_cast<int16_t>(part));
    if (step > 0xFFU) value = static_cast<int16_t>(value + rest);
  }
  return phase >= 2U * kQuarter ? static_cast<int16_t>(-value) : value;
}

uint32_t turns_per_ms(const CardRow& row) {
  return 0xFFFFFFFFU / row.duration_ms;
}

void deflect(const CardRow& row, uint32_t turns, uint16_t t_ms, int16_t* ticks) {
  for (uint8_t axis = 0; axis < kCardAxes; ++axis) {
    const bool over = t_ms >= row.duration_ms;
    ticks[axis] = over ? int16_t{0} : static_cast<int16_t>(row.amplitude_us[axis] * kTicks);
  }
  bool up = true;
  switch (static_cast<CardShape>(row.shape)) {
    case CardShape::kPulse:
      break;
    case CardShape::kDoublet:
      up = 2U * static_cast<uint32_t>(t_ms) < row.duration_ms;
      break;
    case CardShape::kThreeTwoOneOne:
      up = up_in_3211(t_ms, row.duration_ms);
      break;
    case CardShape::kSweep: {
      const int32_t sine = sin14(sweep_phase(row, t_ms));
      for (uint8_t axis = 0; axis < kCardAxes; ++axis) {
        ticks[axis] = scaled(sine * kSweepScale, ticks[axis]);
      }
      return;
    }
    case CardShape::kMultisine:
      multisine(row, turns, t_ms, ticks);
      return;
  }
  if (up) return;
  for (uint8_t axis = 0; axis < kCardAxes; ++axis) {
    ticks[axis] = static_cast<int16_t>(-ticks[axis]);
  }
}

}  // namespace core
