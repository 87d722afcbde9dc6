// Envelopes and lines of text on one port: whole, in time, and none while a session is recorded.
#include <string.h>

#include "app/usb_channels.h"
#include "check.h"
#include "core/envelope.h"
#include "hal/serial.h"
#include "random_numbers.h"

namespace {

constexpr uint8_t kQueueBytes = 73;  // as boards/mega2560/serial.cpp has it
constexpr uint16_t kLineBytes = 300;
constexpr uint8_t kPartBytes = 30;
constexpr uint8_t kPartRoom = 48;

// Reads the port as a computer would: envelopes, and text that is only let through line by line.
struct Reader {
  void byte(uint8_t value) {
    const uint32_t skipped = decoder.skipped();
    if (decoder.byte(value)) frame();
    if (decoder.skipped() == skipped) return;
    // A line of the test counts 1, 2, 3 and so on, then begins again.
    if (value != static_cast<uint8_t>(in_line % 100 + 1)) ++torn;
    in_line = static_cast<uint16_t>(in_line + 1);
    if (in_line == kLineBytes) {
      in_line = 0;
      ++lines;
    }
  }

  void frame() {
    if (in_line != 0) ++torn;
    if (decoder.frame()[0] == 0) {
      ++hashes;
      return;
    }
    frames::IdentFrame ident;
    memcpy(&ident, decoder.frame() + 1, sizeof ident);
    const uint32_t step_us = ident.t_us - last_us;
    if (idents > 0 && step_us < least_us) least_us = step_us;
    if (idents > 0 && step_us > most_us) most_us = step_us;
    last_us = ident.t_us;
    ++idents;
  }

  core::EnvelopeDecoder decoder;
  uint32_t last_us = 0;
  uint32_t least_us = UINT32_MAX;
  uint32_t most_us = 0;
  uint16_t in_line = 0;
  uint16_t torn = 0;
  uint16_t lines = 0;
  uint16_t idents = 0;
  uint16_t hashes = 0;
};

// A port of 115200 baud, emptied as time goes on.
struct Port {
  void run_until(uint32_t now_us) {
    constexpr uint8_t kByteUs = 87;
    while (queued > 0 && static_cast<int32_t>(now_us - sent_us) >= kByteUs) {
      sent_us += kByteUs;
      reader.byte(queue[first]);
      first = static_cast<uint8_t>((first + 1) % kQueueBytes);
      --queued;
    }
    if (queued == 0) sent_us = now_us;
  }

  void put(uint8_t value) {
    if (queued == kQueueBytes) {
      ++overrun;
      return;
    }
    queue[(first + queued) % kQueueBytes] = value;
    ++queued;
  }

  Reader reader;
  uint8_t queue[kQueueBytes] = {};
  uint8_t first = 0;
  uint8_t queued = 0;
  uint16_t overrun = 0;
  uint32_t sent_us = 0;
};

Port* g_port = nullptr;

// The main loop around it, in turns of a millisecond and more.
struct Loop {
  Loop(uint32_t start_us, uint16_t rate_hz, uint32_t seed)
      : random(seed), now_us(start_us), frame_us(start_us), line_us(start_us) {
    period_us = uint32_t{1000000} / rate_hz;
    port.sent_us = start_us;
    g_port = &port;
  }

  void turn(bool recording) {
    now_us += 1000U + random.below(300);
    port.run_until(now_us);
    channels.allow(!recording && left == 0);
    if (now_us - frame_us >= period_us + 5000U) {  // its scan has ended
      frame_us += period_us;
      frames::IdentFrame frame = {};
      frame.t_us = frame_us;
      channels.offer(frame);
      return;
    }
    if (kQueueBytes - port.queued < kPartRoom) return;
    if (left > 0) {
      for (uint8_t i = 0; i < kPartBytes; ++i, --left) {
        port.put(static_cast<uint8_t>((kLineBytes - left) % 100 + 1));
      }
    } else if (now_us - line_us >= 1000000UL && channels.begin_line(now_us)) {
      line_us += 1000000UL;
      left = kLineBytes;
    }
  }

  void run(uint32_t us, bool recording) {
    for (const uint32_t from_us = now_us; now_us - from_us < us;) turn(recording);
  }

  Random random;
  app::UsbChannels channels;
  Port port;
  uint32_t now_us;
  uint32_t frame_us;
  uint32_t line_us;
  uint32_t period_us = 0;
  uint16_t left = 0;
};

}  // namespace

namespace hal {

uint16_t send_room(hal::Port port) {
  return port == hal::Port::kUsb ? static_cast<uint16_t>(kQueueBytes - g_port->queued) : 0;
}

void send_bytes(hal::Port, const uint8_t* bytes, uint8_t size) {
  while (size-- != 0) g_port->put(*bytes++);
}

}  // namespace hal

TEST_CASE("twenty a second, lines between them whole, whatever the turns") {
  const uint32_t starts_us[] = {0, 0xFFF00000UL};  // the clock goes round in the second
  const uint16_t rates_hz[] = {100, 200};
  for (const uint32_t start_us : starts_us) {
    for (const uint16_t rate_hz : rates_hz) {
      Loop loop(start_us, rate_hz, 1U + rate_hz);
      loop.run(5000000UL, false);
      const Reader& reader = loop.port.reader;
      CHECK_EQ(reader.torn, 0);
      CHECK_EQ(loop.port.overrun, 0);
      CHECK_EQ(reader.decoder.failed(), 0);
      CHECK(reader.idents >= 98);
      CHECK(reader.idents <= 101);
      CHECK(reader.least_us == 50000UL);
      CHECK(reader.most_us == 50000UL);
      CHECK(reader.lines >= 4);
      CHECK(reader.hashes >= reader.lines);
    }
  }
}

TEST_CASE("nothing begins while a session is recorded, what is under way is ended") {
  Loop loop(0, 100, 5);
  loop.run(2030000UL, false);
  const uint16_t before = loop.port.reader.idents;
  loop.run(100000UL, true);
  CHECK(loop.port.reader.idents <= before + 1);
  CHECK_EQ(loop.port.reader.in_line, 0);
  const Reader silent = loop.port.reader;
  loop.run(3000000UL, true);
  CHECK_EQ(loop.port.reader.idents, silent.idents);
  CHECK_EQ(loop.port.reader.lines, silent.lines);
  CHECK(loop.port.reader.decoder.skipped() == silent.decoder.skipped());
  loop.run(1000000UL, false);
  CHECK(loop.port.reader.idents >= silent.idents + 19);
  CHECK_EQ(loop.port.reader.torn, 0);
}

TEST_CASE("without frames lines come all the same") {
  Loop loop(0, 100, 6);
  loop.period_us = 3600000000UL;
  loop.run(5000000UL, false);
  CHECK_EQ(loop.port.reader.idents, 0);
  CHECK(loop.port.reader.lines >= 4);
  CHECK_EQ(loop.port.reader.torn, 0);
}

TEST_CASE("a port that does not empty gets nothing") {
  Loop loop(0, 100, 7);
  loop.port.queued = 1;
  loop.port.sent_us = 0x70000000UL;
  frames::IdentFrame frame = {};
  frame.t_us = 100000UL;
  loop.channels.allow(true);
  loop.channels.offer(frame);
  CHECK_EQ(loop.port.queued, 1);
}
