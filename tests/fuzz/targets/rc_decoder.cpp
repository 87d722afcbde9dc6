// Edges at any time in any order: a width that is given out is that of a pulse that was there, both
// its edges stamped in time.
#include "core/rc_decoder.h"
#include "feed.h"

namespace {

constexpr uint8_t kRemembered = 8;

// The last pulses of an input, put together from the edges by the reading of the header alone.
struct Line {
  uint32_t rise = 0;
  bool in_time = false;
  bool high = false;
  uint32_t widths[kRemembered] = {};
  uint8_t next = 0;

  void edge(uint32_t t_ticks, bool level, bool late) {
    if (level && !high) {
      rise = t_ticks;
      in_time = !late;
    } else if (!level && high && in_time && !late) {
      widths[next] = t_ticks - rise;
      next = static_cast<uint8_t>((next + 1) % kRemembered);
    }
    high = level;
  }
  bool had(uint32_t width) const {
    for (const uint32_t one : widths) {
      if (one == width) return true;
    }
    return false;
  }
};

}  // namespace

int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  Feed feed(bytes, size);
  core::RcDecoder decoder;
  Line lines[core::kRcInputs];
  uint16_t before[core::kRcInputs] = {};
  bool started = false;
  uint32_t now_ticks = feed.u32();
  while (feed.more()) {
    // Steps are short or as long as pulses, gaps and frames are.
    const uint8_t what = feed.u8();
    const uint8_t levels = feed.u8() & 0x1F;
    const uint32_t step = feed.u8();
    now_ticks += (what & 0x0C) == 0 ? step : (what & 0x0C) == 4 ? step * 64U : step * 512U;
    const bool late = (what & 0x10) != 0;
    switch (what & 0x03) {
      case 0:
      case 1:
        decoder.edge(now_ticks, levels, late);
        for (uint8_t i = 0; i < core::kRcInputs; ++i) {
          const bool level = (levels >> i & 1) != 0;
          if (started) {
            lines[i].edge(now_ticks, level, late);
          } else {
            lines[i].high = level;
            lines[i].in_time = false;
          }
        }
        started = true;
        break;
      case 2:
        decoder.poll(now_ticks);
        break;
      default:
        if ((what & 0xE0) == 0xE0) {
          decoder.storm();
          ALWAYS(decoder.valid() == 0);
          started = false;
        } else if ((what & 0xE0) == 0xC0) {
          decoder.gap();
          started = false;
        }
        break;
    }
    for (uint8_t i = 0; i < core::kRcInputs; ++i) {
      const uint16_t width = decoder.width_ticks(i);
      ALWAYS(width == 0 || (width >= core::RcDecoder::kMinWidthTicks &&
                            width <= core::RcDecoder::kMaxWidthTicks));
      ALWAYS((width != 0) == ((decoder.valid() >> i & 1) != 0));
      ALWAYS(width == 0 || width == before[i] || lines[i].had(width));
      before[i] = width;
    }
    ALWAYS((decoder.fresh() & ~decoder.valid()) == 0);
    ALWAYS((decoder.steady() & ~decoder.valid()) == 0);
    ALWAYS(decoder.valid() != 0 || decoder.frame_us() == 0);
  }
  // Silence: whatever came before, every channel is lost.
  decoder.poll(now_ticks);
  for (uint8_t i = 0; i < 40; ++i) {
    now_ticks += core::RcDecoder::kAgeTicks;
    decoder.poll(now_ticks);
  }
  ALWAYS(decoder.valid() == 0);
  return 0;
}
