// The shared cases of protocol/cases.toml, then envelopes in random noise.
#include <string.h>

#include "check.h"
#include "core/envelope.h"
#include "generated/cases.h"
#include "generated/frames.h"
#include "random_numbers.h"

namespace {

// Compares frames as they come with those of a case.
class Expected {
 public:
  explicit Expected(const cases::TelemetryCase& truth) : at_(truth.frames) {}

  bool matches(const core::EnvelopeDecoder& decoder) {
    uint8_t size = 0;
    cases::copy(&size, at_, 1);
    uint8_t bytes[core::kEnvelopeMaxFrame];
    cases::copy(bytes, at_ + 1, size);
    at_ += size + 1;
    ++count_;
    return size == decoder.frame_size() && memcmp(bytes, decoder.frame(), size) == 0;
  }
  uint8_t count() const { return count_; }

 private:
  const uint8_t* at_;
  uint8_t count_ = 0;
};

void run(const cases::TelemetryCase& truth) {
  core::EnvelopeDecoder decoder;
  Expected expected(truth);
  for (uint16_t i = 0; i < truth.size; ++i) {
    uint8_t value = 0;
    cases::copy(&value, truth.bytes + i, 1);
    for (bool found = decoder.byte(value); found; found = decoder.next()) {
      REQUIRE(expected.count() < truth.frame_count);
      CHECK(expected.matches(decoder));
    }
  }
  CHECK_EQ(expected.count(), truth.frame_count);
  CHECK_EQ(decoder.failed(), truth.failed);
  CHECK(decoder.skipped() == truth.skipped);
  CHECK_EQ(decoder.pending(), truth.pending);
}

}  // namespace

TEST_CASE("every telemetry case of the protocol") {
  for (uint8_t i = 0; i < cases::kTelemetryCaseCount; ++i) {
    run(cases::load(&cases::kTelemetryCases[i]));
  }
}

TEST_CASE("what is put is decoded, whatever noise stands between") {
  Random random(1);
  core::EnvelopeDecoder decoder;
  uint16_t found = 0;
  uint32_t early = 0;
  uint32_t noise = 0;
  for (uint16_t round = 0; round < 300; ++round) {
    uint8_t fields[core::kEnvelopeMaxFrame];
    const uint8_t size = static_cast<uint8_t>(random.byte() % core::kEnvelopeMaxFrame);
    for (uint8_t i = 0; i < size; ++i) {
      fields[i] = random.byte();
    }
    uint8_t bytes[core::kEnvelopeMaxFrame + core::kEnvelopeOverhead];
    const uint8_t id = random.byte();
    const uint8_t total = core::put_envelope(bytes, id, fields, size);
    REQUIRE(total == size + 6);
    // Noise without the first sync byte cannot swallow what follows.
    for (uint8_t i = static_cast<uint8_t>(random.byte() % 20); i != 0; --i) {
      const uint8_t value = random.byte();
      if (value != core::kEnvelopeSync0) {
        ++noise;
        early += decoder.byte(value) ? 1U : 0U;
      }
    }
    for (uint8_t i = 0; i + 1 < total; ++i) {
      early += decoder.byte(bytes[i]) ? 1U : 0U;
    }
    const bool whole = decoder.byte(bytes[total - 1]);
    if (whole && decoder.frame_size() == size + 1 && decoder.frame()[0] == id &&
        memcmp(decoder.frame() + 1, fields, size) == 0) {
      ++found;
    }
  }
  CHECK_EQ(found, 300);
  CHECK_EQ(early, 0);
  CHECK(decoder.skipped() == noise);
  CHECK_EQ(decoder.failed(), 0);
}

TEST_CASE("pure noise, rich in syncs, accounts for every byte") {
  Random random(2);
  core::EnvelopeDecoder decoder;
  uint32_t in_frames = 0;
  const uint16_t total = 20000;
  for (uint16_t i = 0; i < total; ++i) {
    const uint8_t dice = random.byte();
    const uint8_t value = dice < 60    ? core::kEnvelopeSync0
                          : dice < 120 ? core::kEnvelopeSync1
                                       : random.byte();
    uint8_t last = 0;
    for (bool found = decoder.byte(value); found; found = decoder.next()) {
      last = static_cast<uint8_t>(decoder.frame_size() + core::kEnvelopeOverhead);
      in_frames += last;
    }
  }
  CHECK(in_frames + decoder.skipped() + decoder.pending() == total);
  CHECK(decoder.failed() > 100);
}

TEST_CASE("a frame that is too long is refused") {
  uint8_t fields[core::kEnvelopeMaxFrame] = {};
  uint8_t bytes[4];
  CHECK_EQ(core::put_envelope(bytes, 1, fields, core::kEnvelopeMaxFrame), 0);
}

TEST_CASE("the longest frame is put and decoded, one byte more is neither") {
  uint8_t fields[200];
  for (uint8_t i = 0; i < sizeof(fields); ++i) {
    fields[i] = static_cast<uint8_t>(i + 1);
  }
  uint8_t bytes[core::kEnvelopeMaxFrame + core::kEnvelopeOverhead + 1];
  memset(bytes, 0xEE, sizeof(bytes));
  const uint8_t size = core::put_envelope(bytes, 9, fields, core::kEnvelopeMaxFrame - 1);
  REQUIRE(size == sizeof(bytes) - 1);
  CHECK_EQ(bytes[size], 0xEE);
  core::EnvelopeDecoder decoder;
  for (uint8_t i = 0; i < size; ++i) {
    CHECK_EQ(decoder.byte(bytes[i]), i + 1 == size);
  }
  CHECK_EQ(decoder.frame_size(), core::kEnvelopeMaxFrame);
  CHECK_EQ(decoder.pending(), 0);
  CHECK_EQ(core::put_envelope(bytes, 9, fields, core::kEnvelopeMaxFrame + 1), 0);
  CHECK_EQ(core::put_envelope(bytes, 9, fields, 200), 0);
}

TEST_CASE("a length of nothing or of too much fails as soon as it is read") {
  const uint8_t lengths[] = {0, 129, 255};
  for (const uint8_t length : lengths) {
    core::EnvelopeDecoder decoder;
    CHECK(!decoder.byte(0xA5));
    CHECK_EQ(decoder.pending(), 1);
    CHECK(!decoder.byte(0x5A));
    CHECK_EQ(decoder.pending(), 2);
    CHECK(!decoder.byte(length));
    CHECK_EQ(decoder.failed(), 1);
    CHECK_EQ(decoder.skipped(), 3U);
    CHECK_EQ(decoder.pending(), 0);
  }
  // Its first byte alone is no sync: the next decides.
  core::EnvelopeDecoder decoder;
  decoder.byte(0xA5);
  decoder.byte(0xA5);
  CHECK_EQ(decoder.skipped(), 1U);
  CHECK_EQ(decoder.pending(), 1);
  CHECK_EQ(decoder.failed(), 0);
  decoder.byte(0x00);
  CHECK_EQ(decoder.skipped(), 3U);
}

TEST_CASE("frames inside an envelope that failed come out of one byte, one after the other") {
  const uint8_t field = 0x42;
  uint8_t inner[14];
  const uint8_t first = core::put_envelope(inner, 1, &field, 1);
  const uint8_t second = core::put_envelope(inner + first, 2, &field, 1);
  REQUIRE(first + second == sizeof(inner));
  core::EnvelopeDecoder decoder;
  decoder.byte(0xA5);
  decoder.byte(0x5A);
  decoder.byte(sizeof(inner) - 2);  // the last two of them stand where its CRC would
  for (uint8_t i = 0; i < sizeof(inner) - 1; ++i) {
    CHECK(!decoder.byte(inner[i]));
  }
  REQUIRE(decoder.byte(inner[sizeof(inner) - 1]));
  CHECK_EQ(decoder.frame()[0], 1);
  CHECK_EQ(decoder.pending(), second);
  REQUIRE(decoder.next());
  CHECK_EQ(decoder.frame()[0], 2);
  CHECK_EQ(decoder.frame_size(), 2);
  CHECK_EQ(decoder.pending(), 0);
  CHECK(!decoder.next());
  CHECK_EQ(decoder.failed(), 1);
  CHECK_EQ(decoder.skipped(), 3U);
}
