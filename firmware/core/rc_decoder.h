// Receiver edges in, pulse widths out. One tick is 0.5 us. Main loop only; the interrupt stores
// {16-bit stamp, levels, late?} and the loop extends the stamp with `extend_ticks`.
//
// A pulse is accepted when both edges were stamped in time, its width is 800 to 2200 us, the line
// was low for 2 ms before and 300 us after it (a dropout inside a pulse would else leave two short
// ones), and since the last accepted pulse rose the measured frame time less 4.5 ms passed (9 ms
// while it is not known). Channels that come all at once above 250 Hz leave no 2 ms of low: such a
// receiver is refused, and said to be. Frame times from 14 to 22.5 ms and receivers that send
// channels one after the other or all at once pass without being told.
#pragma once

#include <stdint.h>

#include "core/bytes.h"

namespace core {

constexpr uint8_t kRcInputs = 5;
constexpr uint16_t kTicksPerUs = 2;

// The 32-bit time of a 16-bit stamp at most 32 ms old.
inline uint32_t extend_ticks(uint32_t now_ticks, uint16_t stamp) {
  return now_ticks - static_cast<uint16_t>(static_cast<uint16_t>(now_ticks) - stamp);
}

class RcDecoder {
 public:
  static constexpr uint32_t kMinWidthTicks = 800UL * kTicksPerUs;
  static constexpr uint32_t kMaxWidthTicks = 2200UL * kTicksPerUs;
  static constexpr uint32_t kLowBeforeTicks = 2000UL * kTicksPerUs;
  static constexpr uint32_t kLowAfterTicks = 300UL * kTicksPerUs;
  static constexpr uint32_t kMinPeriodTicks = 9000UL * kTicksPerUs;
  static constexpr uint32_t kMaxPeriodTicks = 25000UL * kTicksPerUs;
  static constexpr uint32_t kFreshTicks = 45000UL * kTicksPerUs;  // one frame missed, not two
  // With 2 ms of kAgeTicks, 3 ms of a turn and 46 ms of the slowest pump and relay (hw/relay.md)
  // the relay lets go within 100 ms of the last pulse.
  static constexpr uint32_t kUnsteadyTicks = 49000UL * kTicksPerUs;
  static constexpr uint32_t kLostTicks = 60000UL * kTicksPerUs;
  static constexpr uint32_t kAgeTicks = 2000UL * kTicksPerUs;  // between two looks at all ages
  static constexpr uint8_t kSteadyPulses = 3;
  static constexpr uint8_t kRefusedPulses = 250;  // in a row, of all inputs: 0.2 s at 250 Hz

  // Levels of all inputs (bit 0 to 4) behind an edge. `late`: the stamp cannot be trusted.
  void edge(uint32_t t_ticks, uint8_t levels, bool late);
  // Edges were lost or the bank was masked: whatever is half seen is forgotten.
  void gap();
  // Edge storm: every channel is lost at once.
  void storm();
  // At least every 10 ms, after the edges: accepts confirmed pulses, forgets old ones.
  void poll(uint32_t now_ticks);
  // A pulse waits for its low time: poll again within a millisecond.
  bool waiting() const { return waiting_ != 0; }

  // 0: no pulse accepted within 60 ms, seen 2 ms later at most.
  uint16_t width_ticks(uint8_t input) const { return inputs_[input].width; }
  uint8_t valid() const { return valid_; }  // bit per input: width is not 0
  uint8_t fresh() const { return fresh_; }  // bit per input: last pulse at most 45 ms old
  // Bit per input: three accepted in a row, the last at most 49 ms ago.
  uint8_t steady() const { return steady_; }
  uint16_t frame_us() const { return frame_us_; }  // 0: not known
  // Rate in Hz of pulses that follow each other too fast to be used, while none is accepted; else
  // 0.
  uint16_t refused_hz() const {
    return fast_pulses_ < kRefusedPulses
               ? uint16_t{0}
               : static_cast<uint16_t>(1000000UL * kTicksPerUs / fast_ticks_);
  }
  // Since the oldest of the inputs' last accepted pulses rose; while none is lost. Within 128 us,
  // by the two bytes in the middle of each time: all four took 0.5 % of the chip.
  uint32_t oldest_us(uint32_t now_ticks) const {
    const uint16_t now = static_cast<uint16_t>(now_ticks >> 8U);
    uint16_t oldest = 0;
    for (const Input& input : inputs_) {
      const uint16_t age = static_cast<uint16_t>(now - middle(input.accepted));
      if (age > oldest) oldest = age;
    }
    return (static_cast<uint32_t>(oldest) << 8U) / kTicksPerUs;
  }
  uint8_t changes() const { return changes_; }     // counts what poll and edge changed of these
  uint16_t glitches() const { return glitches_; }  // pulses rejected

 private:
  struct Input {
    uint32_t rise = 0;       // last rising edge
    uint32_t fall = 0;       // last falling edge
    uint32_t accepted = 0;   // rise of the last accepted pulse
    uint16_t width = 0;      // last accepted; 0 when lost
    uint16_t candidate = 0;  // waits for its low time
    uint8_t streak = 0;
  };

  // Of a time that lies in memory, in 256 ticks: two bytes of it are read.
  static uint16_t middle(const uint32_t& ticks) {
    return get_le<uint16_t>(reinterpret_cast<const uint8_t*>(&ticks) + 1);
  }

  void rise(Input& input, uint8_t bit, uint32_t t_ticks, bool late);
  void fall(Input& input, uint8_t bit, uint32_t t_ticks, bool late);
  void count_fast(uint32_t period_ticks);
  void confirm(uint32_t now_ticks);
  void settle(Input& input, uint8_t bit, uint32_t low_ticks);
  void measure_frame(uint16_t period_us);
  void reject(Input& input, uint8_t bit);
  void lose(Input& input, uint8_t bit);

  Input inputs_[kRcInputs];
  uint32_t aged_ticks_ = 0;  // the last look at all ages
  uint16_t frame_us_ = 0;
  uint16_t glitches_ = 0;
  uint16_t fast_ticks_ = 1;  // from rise to rise of the last pulse that came too fast
  uint8_t fast_pulses_ = 0;
  uint8_t levels_ = 0;
  uint8_t trusted_ = 0;  // bit per input: the rise was stamped in time, after a long enough low
  uint8_t valid_ = 0;
  uint8_t fresh_ = 0;
  uint8_t steady_ = 0;
  uint8_t changes_ = 0;
  uint8_t waiting_ = 0;  // bit per input: it has a candidate
  uint8_t early_ = 0;    // pulses refused for coming early
  bool locked_ = false;  // frame_us_ bounds how early the next pulse may come
  bool started_ = false;
};

}  // namespace core
