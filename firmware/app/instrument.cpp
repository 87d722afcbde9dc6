#include "app/instrument.h"

#include "app/text_out.h"
#include "core/progmem.h"
#include "hal/analog_input.h"
#include "hal/clock.h"
#include "hal/serial.h"
#include "hal/system.h"

namespace app {

namespace {

constexpr uint32_t kUsbBaud = 115200UL;
constexpr uint32_t kSecondUs = 1000000UL;
// Frame `system` takes 1.7 ms: in a storm of edges it waits for a shorter turn, 0.2 s at most.
constexpr uint32_t kLongTurnUs = 500;
constexpr uint8_t kMostPutOff = 20;
constexpr uint8_t kCountedTurns = 251;  // a prime: no phase of the scan is left out
constexpr uint16_t kShares = 256;
// Waking for an interrupt and going back to sleep takes 14 cycles, a tenth of what a mean one
// takes; a turn that counts does not sleep.
constexpr uint8_t kWakingShare = 10;

constexpr char kLineEnd[] CORE_FLASH = "\r\n";

}  // namespace

void Instrument::boot() {
  const uint32_t now_us = hal::now_us();
  const core::SettingsStatus settings = store_.load(&config_);
  hal::open_port(hal::Port::kUsb, kUsbBaud);
  TextOut usb(hal::Port::kUsb);
  Status::name(&usb);
  usb.flash(kLineEnd);
  outlet_.event(frames::Event::kReset, static_cast<uint32_t>(hal::reset_source()), now_us);
  if (hal::crash_address() != 0) {
    outlet_.event(frames::Event::kCrash, hal::crash_address(), now_us);
  }
  if (settings != core::SettingsStatus::kOk) {
    outlet_.event(frames::Event::kSettingsDefault, static_cast<uint32_t>(settings), now_us);
  }
  inputs_.load(config_);
  telemetry_.start(config_, now_us);
  pilot_.start();
  sensors_.start(config_, now_us);
  status_.start(now_us);
  ascii_row_.start(now_us);
  second_.start(now_us);
  airborne_.start(hal::flight_mark(), now_us);
  turn_us_ = now_us;
  system_us_ = now_us;
  hal::measure_supply();
  hal::start_watchdog();
}

void Instrument::step() {
  const uint32_t now_us = turn_us_;
  pilot_.step(config_, supply_.good(), inputs_, outlet_, now_us);
  const uint8_t frames = outlet_.frames();
  const storage::Volume::Job job = recorder_.card_job();
  sensors_.step(config_, pilot_, outlet_, now_us);
  const bool made_frame = outlet_.frames() != frames;
  if (inputs_.watch(sensors_, outlet_, now_us)) pilot_.send(inputs_, outlet_);
  pilot_.ran(kTaskSensors);
  // A receiver pulse that ends behind the pilot's step, or 0.3 ms before it, waits for the next,
  // and 2 ms is all it may: making a frame takes more than half of that, and so do the slow tasks.
  if (made_frame) pilot_.step(config_, supply_.good(), inputs_, outlet_, hal::now_us());
  recorder_.step(now_us);
  pilot_.ran(kTaskRecorder);
  // A turn that made a frame leaves the rest to the next, for the same reason.
  bool wrote = false;
  if (!made_frame) {
    // A reading per turn: a row is 30 ms long, and no turn is.
    ascii_row_.step(sensors_, pilot_.channels(), telemetry_, now_us);
    wrote = status_.has_line() && write_status(now_us);
    // The learning has turns of its own, at most every second one.
    const bool learns = !wrote && !learned_ && inputs_.learn(outlet_, now_us);
    learned_ = learns;
    if (!wrote && !learns) step_slow(now_us);
    pilot_.step(config_, supply_.good(), inputs_, outlet_, hal::now_us());
  }
  // Nor is a job begun and worked on in one turn: deciding that a file is closed and building its
  // last block together took 3.7 ms. A part of the status line with a job, in turn after turn, let
  // the gate of the relay's transistor sink to 1.96 V.
  if (!wrote && outlet_.frames() == frames && recorder_.card_job() == job) recorder_.work(now_us);
  // By the time it is now: a rest is at most one turn longer than the least time between edges.
  const uint32_t end_us = hal::now_us();
  pilot_.beat(outlet_, end_us);

  const uint32_t loop_us = end_us - now_us;
  if (loop_us > loop_max_us_) {
    loop_max_us_ = static_cast<uint16_t>(loop_us > 65535U ? 65535U : loop_us);
  }
  // A card that is searched gives the next block at once.
  const bool rests = !recorder_.in_a_hurry();
  uint16_t idle_us = 0;
  const bool counts = rests && ++counted_turn_ == kCountedTurns;
  if (counts) {
    idle_us = hal::idle_until_interrupt();
  } else if (rests) {
    hal::sleep_until_interrupt();
  }
  turn_us_ = hal::now_us();
  const uint32_t rest_us = turn_us_ - end_us;
  asleep_us_ += rest_us;
  if (counts) {
    counted_turn_ = 0;
    counted_us_ = static_cast<uint16_t>(counted_us_ + rest_us);
    const uint16_t waking_us = static_cast<uint16_t>((rest_us - idle_us) / kWakingShare);
    if (idle_us <= rest_us && waking_us <= idle_us) {
      idle_us_ = static_cast<uint16_t>(idle_us_ + idle_us - waking_us);
    }
  }
}

// Of the time asleep, without the interrupts in it: their share is known from the turns counted,
// four a second, of about four seconds.
uint32_t Instrument::idle_us() {
  if (counted_us_ == 0) return asleep_us_;
  const uint16_t shares = static_cast<uint16_t>(uint32_t{idle_us_} * kShares / counted_us_);
  idle_us_ = static_cast<uint16_t>(idle_us_ - idle_us_ / 4U);
  counted_us_ = static_cast<uint16_t>(counted_us_ - counted_us_ / 4U);
  return asleep_us_ / kShares * shares;
}

// Not in step(): saving its registers in every turn took 0.4 % of the chip.
__attribute__((noinline)) bool Instrument::write_status(uint32_t now_us) {
  return status_.step(
      recorder_, sensors_, pilot_, store_.reference_mv(), inputs_, outlet_.usb(), now_us);
}

// What need not be done every turn takes turns: each of it every eighth, some 8 ms. A turn
// that wrote a part of the status line leaves them to the next.
void Instrument::step_slow(uint32_t now_us) {
  slot_ = static_cast<uint8_t>((slot_ + 1U) & 7U);
  switch (slot_) {
    case 0:
      store_.poll();
      return;
    case 1:
      panel_.step(recorder_, pilot_.relay_lost(), inputs_, now_us);
      return;
    case 2:
      status_.poll(recorder_.recording(), outlet_.usb(), now_us);
      return;
    case 3:
      inputs_.step_slow(pilot_, sensors_, airborne_.state(), config_, outlet_, now_us);
      listen(now_us);
      return;
    case 4:
      if (telemetry_.poll(now_us)) put_telemetry_heads(now_us);
      return;
    case 5:
      if (put_off_ == 0 && second_.due(now_us, kSecondUs)) put_off_ = 1;
      if (put_off_ == 0) return;
      if (hal::now_us() - now_us >= kLongTurnUs && ++put_off_ < kMostPutOff) return;
      put_off_ = 0;
      put_system(now_us);
      return;
    case 6:
      decide_recording(now_us);
      return;
    case 7:
      pass_self_test();
      listen(now_us);
      return;
    default:
      return;
  }
}

void Instrument::decide_recording(uint32_t now_us) {
  core::PilotInputs pilot = pilot_.inputs(config_);
  pilot.button_down = inputs_.button(pilot.button_down);
  core::AirborneInputs seen;
  sensors_.airborne_inputs(&seen);
  seen.throttle_valid = pilot.throttle_valid;
  seen.throttle_idle = pilot.throttle_idle;
  const core::FlightState before = airborne_.state();
  const core::FlightState state = airborne_.step(seen, now_us);
  if (state != before) {
    outlet_.event(frames::Event::kFlightState, static_cast<uint32_t>(state), now_us);
  }
  recorder_.decide(pilot, airborne_, config_, now_us);
}

// Lines stay whole: no answer within one.
void Instrument::listen(uint32_t now_us) {
  if (status_.has_line()) return;
  card_console_.step(ring_, pilot_, airborne_.state(), config_, inputs_, now_us);
}

// As soon as the supply is measured; put_system() takes it back.
void Instrument::pass_self_test() {
  if (!supply_.good()) (void)supply_.passes(hal::avcc_mv(), store_.reference_mv());
}

void Instrument::put_system(uint32_t now_us) {
  // The supply is measured once a second.
  (void)supply_.measured(hal::avcc_mv(), store_.reference_mv());
  hal::measure_supply();
  const uint32_t elapsed_us = now_us - system_us_;
  uptime_us_ += elapsed_us;
  while (uptime_us_ >= kSecondUs) {
    uptime_us_ -= kSecondUs;
    ++uptime_s_;
  }
  frames::SystemFrame frame = {};
  frame.t_us = now_us;
  frame.uptime_s = uptime_s_;
  frame.loop_max_us = loop_max_us_;
  frame.cpu_load = frames::kSystemCpuLoadInvalid;
  const uint32_t rest_us = idle_us();
  if (elapsed_us >= 1000U && rest_us <= elapsed_us) {
    frame.cpu_load = static_cast<uint16_t>((elapsed_us - rest_us) / (elapsed_us / 1000U));
  }
  recorder_.put_health(&frame);
  sensors_.put_health(&frame);
  frame.avcc_mv = core::supply_mv(hal::avcc_mv(), store_.reference_mv());
  const core::RcDecoder& receiver = pilot_.decoder();
  frame.rc_glitches = receiver.glitches();
  frame.rc_frame_us = receiver.frame_us();
  if (receiver.valid() != 0) {
    frame.sensors = static_cast<uint8_t>(frame.sensors | frames::kSensorsReceiver);
  }
  if (telemetry_.mode() != frames::Telemetry::kOff) {
    frame.sensors = static_cast<uint8_t>(frame.sensors | frames::kSensorsTelemetry);
  }
  frame.telemetry_dropped = telemetry_.dropped();
  frame.stack_free_min = hal::stack_free_bytes();
  frame.drive = static_cast<uint8_t>(pilot_.drive());
  // All this took 1.3 ms and the rest takes 0.4: see step().
  pilot_.step(config_, supply_.good(), inputs_, outlet_, hal::now_us());
  outlet_.put(frame);
  loop_max_us_ = 0;
  asleep_us_ = 0;
  system_us_ = now_us;
}

// Apart, so that its frames stand on the stack for as long as they are made.
__attribute__((noinline)) void Instrument::put_telemetry_heads(uint32_t now_us) {
  frames::ConfigFrame config = config_;
  config.t_us = now_us;
  (void)telemetry_.offer(frames::ConfigFrame::id(), &config, sizeof config, now_us);
  frames::IdentityFrame who;
  recorder_.identity(&who, now_us);
  (void)telemetry_.offer(frames::IdentityFrame::id(), &who, sizeof who, now_us);
}

}  // namespace app
