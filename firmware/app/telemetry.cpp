#include "app/telemetry.h"

#include "core/envelope.h"
#include "core/progmem.h"
#include "hal/serial.h"

namespace app {

namespace {

constexpr uint32_t kHeadsUs = 5000000UL;
constexpr uint8_t kKinds = frames::kBaroCoefficientsId + 1;

// Least time between two frames of a kind, by id, in steps of 1.024 ms: 50, 500, 200 and 200 ms
// less 5, because a trigger has jitter. 20 Hz of ident and the rest make 2.1 kB/s.
constexpr uint16_t kLeastMs[] CORE_FLASH = {0, 44, 484, 191, 191};

uint16_t to_ms(uint32_t now_us) {
  return static_cast<uint16_t>(now_us >> 10);
}

}  // namespace

void Telemetry::start(const frames::ConfigFrame& config, uint32_t now_us) {
  mode_ = static_cast<frames::Telemetry>(config.telemetry);
  budget_.start(now_us, config.telemetry_budget_byteps);
  heads_.start(now_us);
  for (uint16_t& last_ms : last_ms_) last_ms = static_cast<uint16_t>(to_ms(now_us) - 1000U);
  if (mode_ != frames::Telemetry::kOff) {
    hal::open_port(hal::Port::kTelemetry, config.telemetry_baud);
  }
}

bool Telemetry::offer(uint8_t id, const void* fields, uint8_t size, uint32_t now_us) {
  if (mode_ != frames::Telemetry::kFrames || (id >= kKinds && id != frames::kLearnedId)) {
    return false;
  }
  const uint16_t now_ms = to_ms(now_us);
  static_assert(sizeof kLeastMs == sizeof last_ms_, "a time for each kind with a rate");
  const bool paced = id < kPaced;
  if (paced) {
    const uint16_t since_ms = static_cast<uint16_t>(now_ms - last_ms_[id]);
    if (since_ms < core::flash_u16(&kLeastMs[id])) return false;
  }
  if (send(id, fields, size, now_us)) {
    if (paced) last_ms_[id] = now_ms;
    return true;
  }
  if (dropped_ != 0xFFFFU) ++dropped_;
  return false;
}

bool Telemetry::poll(uint32_t now_us) {
  if (mode_ != frames::Telemetry::kFrames || !heads_.due(now_us, kHeadsUs)) return false;
  const uint32_t hash = frames::kSchemaHash;
  (void)send(0, &hash, sizeof hash, now_us);
  return true;
}

bool Telemetry::send(uint8_t id, const void* fields, uint8_t size, uint32_t now_us) {
  const uint8_t total = static_cast<uint8_t>(size + 1 + core::kEnvelopeOverhead);
  if (hal::send_room(hal::Port::kTelemetry) < total) return false;
  if (!budget_.take(total, now_us)) return false;
  core::send_envelope([](const uint8_t* bytes,
                         uint8_t count) { hal::send_bytes(hal::Port::kTelemetry, bytes, count); },
                      id,
                      fields,
                      size);
  return true;
}

bool Telemetry::reserve(uint16_t size, uint32_t now_us) {
  if (budget_.take(size, now_us)) return true;
  if (dropped_ != 0xFFFFU) ++dropped_;
  return false;
}

}  // namespace app
