#include "app/telemetry.h"

#include "core/envelope.h"
#include "core/progmem.h"
#include "hal/serial.h"

namespace app {

namespace {

constexpr uint32_t kHeadsUs = 5000000UL;
constexpr uint8_t kKinds = frames::kBaroCoefficientsId + 1;

// Least time between two frames of a kind, by id. 20 Hz of ident and the rest make 2.1 kB/s.
constexpr uint16_t kIntervalMs[kKinds] CORE_FLASH = {0, 50, 500, 200, 200, 0, 0, 0, 0, 0, 0};

}  // namespace

void Telemetry::start(const frames::ConfigFrame& config, uint32_t now_us) {
  mode_ = static_cast<frames::Telemetry>(config.telemetry);
  budget_.start(now_us, config.telemetry_budget_byteps);
  heads_.start(now_us);
  for (uint32_t& last_us : last_us_) last_us = now_us - uint32_t{1000000};
  if (mode_ != frames::Telemetry::kOff) {
    hal::open_port(hal::Port::kTelemetry, config.telemetry_baud);
  }
}

void Telemetry::offer(uint8_t id, const void* fields, uint8_t size, uint32_t now_us) {
  if (mode_ != frames::Telemetry::kFrames || id >= kKinds) return;
  // A trigger has jitter: a frame 5 ms early still has its turn.
  const uint32_t interval_us = 1000UL * core::flash_load(&kIntervalMs[id]);
  if (now_us - last_us_[id] + 5000U < interval_us) return;
  if (send(id, fields, size, now_us)) {
    last_us_[id] = now_us;
  } else if (dropped_ != 0xFFFFU) {
    ++dropped_;
  }
}

bool Telemetry::poll(uint32_t now_us) {
  if (mode_ != frames::Telemetry::kFrames || !heads_.due(now_us, kHeadsUs)) return false;
  const uint32_t hash = frames::kSchemaHash;
  (void)send(0, &hash, sizeof hash, now_us);
  return true;
}

bool Telemetry::send(uint8_t id, const void* fields, uint8_t size, uint32_t now_us) {
  uint8_t envelope[frames::kMaxWireSize + core::kEnvelopeOverhead];
  const uint8_t total = static_cast<uint8_t>(size + 1 + core::kEnvelopeOverhead);
  if (hal::send_room(hal::Port::kTelemetry) < total) return false;
  if (!budget_.take(total, now_us)) return false;
  const uint8_t filled = core::put_envelope(envelope, id, fields, size);
  for (uint8_t i = 0; i < filled; ++i) hal::send_byte(hal::Port::kTelemetry, envelope[i]);
  return true;
}

bool Telemetry::reserve(uint16_t size, uint32_t now_us) {
  if (budget_.take(size, now_us)) return true;
  if (dropped_ != 0xFFFFU) ++dropped_;
  return false;
}

}  // namespace app
