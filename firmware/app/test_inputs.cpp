#include "app/test_inputs.h"

#include "app/card_store.h"
#include "app/pilot_link.h"
#include "app/sensors.h"
#include "app/store.h"
#include "core/settings.h"
#include "hal/clock.h"
#include "hal/panel.h"
#include "hal/relay.h"

namespace app {

using core::CardHead;
using core::InputCommand;
using core::InputFacts;
using core::InputMemory;
using frames::CardFault;
using frames::Event;
using frames::InputEnd;

namespace {

constexpr uint8_t kLeastRateHz = 100;  // slower frames tell of a limit too late
constexpr uint16_t kWatchUs = 5000;    // ages grow without any news
// A plain pulse is wanted 25 ms behind an age's limit, and servos take 20 of them: 5 are left, and
// with a long turn of the main loop two looks are 8 ms apart. So each looks ahead.
constexpr uint16_t kAheadUs = 3000;
constexpr uint8_t kPaShift = 4;
constexpr int16_t kTilt = 1500;  // 15 deg: what no one takes for level
constexpr uint8_t kEnabledBeeps = 3;
constexpr uint8_t kConfigFrames = 1;  // of the card's frames, before its parts

// What is heard of an end: few enough to count.
uint8_t beeps_of(InputEnd why) {
  switch (why) {
    case InputEnd::kDone:
      return 1;
    case InputEnd::kStick:
    case InputEnd::kSwitch:
    case InputEnd::kButton:
      return 2;
    case InputEnd::kReceiver:
    case InputEnd::kFrameTime:
    case InputEnd::kRelay:
    case InputEnd::kDrive:
      return 4;
    case InputEnd::kSensorLost:
    case InputEnd::kSensorStill:
      return 6;
    case InputEnd::kSupply:
    case InputEnd::kRecorder:
    case InputEnd::kDropped:
    case InputEnd::kLoopLate:
    case InputEnd::kRowDamaged:
      return 7;
    default:
      return 5;  // the envelope
  }
}

}  // namespace

void TestInputs::unload() {
  command_.disable();
  rows_ = 0;
  hash_shown_ = false;
}

void TestInputs::load(const frames::ConfigFrame& config) {
  unload();
  uint8_t record[core::kInputSettingsRecordSize];
  for (uint8_t i = 0; i < sizeof record; ++i) {
    record[i] = hal::read_eeprom(static_cast<uint16_t>(Store::kInputSettingsAddress + i));
  }
  frames::InputConfigFrame input;
  core::read_input_settings(record, config, input);
  armed_min_us_ = input.switch_armed_min_us;
  if (card_marked_valid() && judge_card(config.aircraft) == CardFault::kNone) rows_ = card_rows();
}

void TestInputs::look(const Pilot& pilot,
                      const frames::ConfigFrame& config,
                      Outlet& outlet,
                      uint32_t now_us) {
  const core::RcChannels& channels = *pilot.channels;
  InputFacts facts;
  facts.rc = &channels;
  facts.drive = pilot.drive;
  facts.place = core::switch_place(
      channels.width_ticks[core::kSwitch], config.switch_mega_min_us, armed_min_us_);
  if (!command_.running()) {
    const bool armed = command_.armed();
    if (!command_.trigger(facts.place, pilot.drive == frames::Drive::kMega, now_us)) {
      if (!armed && command_.armed() && holds()) memory_->hold.arm(channels);
      return;
    }
  }
  facts.frame_us = pilot.decoder->frame_us();
  facts.silent_us = pilot.silent_us;
  facts.stick_us = memory_ == nullptr ? uint16_t{0} : memory_->watch.limits.stick_us;
  facts.dropped = outlet.dropped();
  facts.contact = hal::relay_engaged();
  facts.button = hal::button_pressed();
  facts.throttle_idle = channels.width_ticks[core::kThrottle] <=
                        static_cast<uint32_t>(config.throttle_idle_max_us) * core::kTicksPerUs;
  facts.flying = flying_.holds();
  facts.supply = pilot.supply_good;
  InputMemory* const memory = outlet.lend();
  facts.records = memory != nullptr && memory_ != nullptr && config.rate_hz >= kLeastRateHz;
  if (!command_.running()) {
    begin(memory, facts, config.rate_hz, outlet, now_us);
    return;
  }
  InputEnd why = memory == nullptr ? InputEnd::kRecorder : command_.keeps(*memory, facts, now_us);
  if (why == InputEnd::kButton) button_spent_ = true;
  if (why == InputEnd::kDone && !command_.over(*memory, now_us)) {
    command_.steer(*memory, now_us);
    return;
  }
  finish(why, outlet, now_us);
}

// Apart for what stands on the stack: no other look needs it.
__attribute__((noinline)) void TestInputs::begin(InputMemory* memory,
                                                 const InputFacts& facts,
                                                 uint16_t rate_hz,
                                                 Outlet& outlet,
                                                 uint32_t now_us) {
  InputEnd why = InputCommand::passes(facts);
  if (why == InputEnd::kDone && !facts.contact) why = InputEnd::kRelay;
  if (why == InputEnd::kDone) why = memory_->watch.outside();
  if (why == InputEnd::kDone && !travel_.shown()) why = InputEnd::kTravel;
  if (why == InputEnd::kDone && memory_->holds) {
    const uint8_t held = core::held_axes(memory->row);
    if ((senses_ & held) != held) why = InputEnd::kHoldSense;
    if (!memory_->hold.sticks_still(*facts.rc, facts.stick_us)) why = InputEnd::kStick;
  }
  // Its memory may have been the events' since it was judged.
  if (why == InputEnd::kDone &&
      (memory_->judged != CardFault::kNone || !core::row_whole(memory->row))) {
    why = InputEnd::kRowDamaged;
  }
  const uint8_t row = command_.row();
  if (why != InputEnd::kDone) {
    command_.refuse();
    beeps_ = beeps_of(why);
    outlet.event(Event::kInputRefused, row | static_cast<uint32_t>(why) << 8, now_us);
    return;
  }
  memory->rate_max_usps = card_u16(offsetof(CardHead, rate_max_usps));
  command_.start(*memory, facts, now_us);
  if (memory_->holds) {
    memory_->hold.start(now_us);
  } else {
    memory_->learning.start(row, rate_hz);
  }
  memory->t_us = now_us;
  memory->part = static_cast<uint8_t>(frames::kCardHeadParts + row);
  memory_->told = false;
}

// The row and its start, in the turn behind it: a look at its trigger is long enough.
__attribute__((noinline)) bool TestInputs::tell_start(Outlet& outlet) {
  InputMemory* const memory = outlet.lend();
  memory_->told = true;
  if (memory == nullptr) return true;
  outlet.put_row(*memory);
  outlet.event(Event::kInputStart, command_.row() | card_hash() << 8, memory->t_us);
  return true;
}

void TestInputs::lend(RowMemory* memory, Outlet& outlet, uint32_t now_us) {
  memory_ = memory;
  outlet.teach(memory == nullptr ? nullptr : &memory->learning);
  if (memory == nullptr) return;
  core::InputWatch& watch = memory->watch;
  read_card(core::kInputLimitsOffset, &watch.limits, sizeof watch.limits);
  watch.start(now_us);
  memory->learning.stop();
  memory->holds = false;
  memory->judged = CardFault::kNotValid;
  bound_pulses();
}

// The row that the next trigger flies, ahead of it: together they took 0.6 ms.
__attribute__((noinline)) bool TestInputs::judge(Outlet& outlet) {
  InputMemory* const memory = outlet.lend();
  if (memory == nullptr) return false;
  core::RowLimits limits;
  for (uint8_t axis = 0; axis < core::kCardAxes; ++axis) {
    limits.amplitude_max_us[axis] =
        card_u16(static_cast<uint16_t>(offsetof(CardHead, amplitude_max_us) + 2U * axis));
  }
  limits.frequency_max_chz = card_u16(offsetof(CardHead, frequency_max_chz));
  const uint8_t hold = card_hold_part();
  limits.hold = hold != 0;
  read_card_row(command_.row(), &memory->row);
  memory_->judged = core::judge_row(memory->row, limits);
  if (memory_->judged == CardFault::kNone && core::held_axes(memory->row) != 0) {
    load_hold(hold, core::held_axes(memory->row), outlet);
  }
  return true;
}

// What the row holds takes the memory of what it would teach.
__attribute__((noinline)) void TestInputs::load_hold(uint8_t part, uint8_t held, Outlet& outlet) {
  outlet.teach(nullptr);
  frames::CardHoldLayout card;
  read_card_part(part, reinterpret_cast<uint8_t*>(&card));
  memory_->hold.load(card, held, card_u16(offsetof(CardHead, rate_max_usps)));
  memory_->holds = true;
  memory_->watch.found[core::InputWatch::kHold] = InputEnd::kSensorLost;
}

bool TestInputs::watch_sensors(const Sensors& sensors, Outlet& outlet, uint32_t turn_us) {
  if (memory_ == nullptr || outlet.lend() == nullptr) {
    if (!command_.running()) return false;
    finish(InputEnd::kRecorder, outlet, hal::now_us());
    return true;
  }
  core::InputWatch& watch = memory_->watch;
  if (!news(sensors, watch, turn_us)) return false;
  const uint32_t now_us = hal::now_us();
  see(sensors, *outlet.lend(), now_us);
  if (!command_.running()) return false;
  InputEnd why = watch.outside();
  if (why == InputEnd::kDone && !flying_.holds()) why = InputEnd::kNotFlying;
  if (why == InputEnd::kDone) return false;
  finish(why, outlet, now_us);
  return true;
}

// Of any sensor, or it is time to ask whether one has ceased.
bool TestInputs::news(const Sensors& sensors,
                      const core::InputWatch& watch,
                      uint32_t turn_us) const {
  return sensors.imu().seq != watch.imu || sensors.scans() != watch.scan ||
         static_cast<uint16_t>(static_cast<uint16_t>(turn_us) - watch.looked_us) >= kWatchUs ||
         static_cast<uint16_t>(sensors.baro().t_us) != watch.baro_us ||
         sensors.gps_heard_us() != watch.gps_us;
}

// Each sensor is looked at on its own news, so that what comes seldom costs little; that one ceased
// is seen with each scan, and each 5 ms where none comes.
void TestInputs::see(const Sensors& sensors, InputMemory& memory, uint32_t now_us) {
  using core::InputWatch;
  InputWatch& watch = memory_->watch;
  core::InputReadings in;
  const uint8_t imu = sensors.imu().seq;
  if (imu != watch.imu) {
    watch.imu = imu;
    sensors.imu_readings(&in);
    watch.motion.see_imu(in, now_us);
    watch.found[InputWatch::kImu] = core::judge_imu(watch.limits, in);
    if (memory_->holds) {
      watch.found[InputWatch::kHold] = command_.running()
                                           ? memory_->hold.step(in, memory.applied_ticks, now_us)
                                           : memory_->hold.may_start(in);
    }
  }
  const uint16_t baro_us = static_cast<uint16_t>(sensors.baro().t_us);
  if (baro_us != watch.baro_us) {
    watch.baro_us = baro_us;
    sensors.baro_readings(&in);
    watch.motion.see_baro(in, now_us);
    watch.found[InputWatch::kBaro] = core::judge_baro(watch.limits, in, home_);
  }
  const uint16_t gps_us = sensors.gps_heard_us();
  if (gps_us != watch.gps_us) {
    watch.gps_us = gps_us;
    sensors.gps_readings(&in);
    watch.motion.see_gps(in, now_us);
    watch.found[InputWatch::kGps] = core::judge_gps(watch.limits, in, home_);
  }
  const uint8_t scan = sensors.scans();
  const uint16_t now = static_cast<uint16_t>(now_us);
  const bool scanned = scan != watch.scan;
  if (!scanned && static_cast<uint16_t>(now - watch.looked_us) < kWatchUs) return;
  if (scanned) {
    watch.scan = scan;
    sensors.scan_readings(&in);
    watch.motion.see_scan(watch.limits, in, now_us);
    watch.found[InputWatch::kScan] = core::judge_scan(watch.limits, in);
  }
  watch.looked_us = now;
  watch.motion.age(now_us);
  sensors.ages(&in, now_us + kAheadUs);
  if (scanned) {
    sensors.gps_readings(&in);
    flying_.look(in, now_us + kAheadUs);
  } else if (in.scan_age_us > core::kInputScanAgeUs) {
    look_for_flight(sensors, now_us + kAheadUs);
  }
  watch.found[InputWatch::kHeard] = core::judge_heard(watch.limits, in, watch.motion, now_us);
}

void TestInputs::look_for_flight(const Sensors& sensors, uint32_t now_us) {
  core::InputReadings in;
  sensors.scan_readings(&in);
  sensors.gps_readings(&in);
  sensors.ages(&in, now_us);
  flying_.look(in, now_us);
}

void TestInputs::finish(InputEnd why, Outlet& outlet, uint32_t now_us) {
  if (memory_ != nullptr && !memory_->told) tell_start(outlet);
  const uint32_t ms = (now_us - command_.since_us()) / 1000U;
  const uint8_t row = command_.row();
  command_.end(rows_);
  beeps_ = beeps_of(why);
  outlet.event(Event::kInputEnd, row | static_cast<uint32_t>(why) << 8 | ms << 16, now_us);
}

void TestInputs::bound_pulses() {
  for (uint8_t axis = 0; axis < core::kCardAxes; ++axis) {
    const uint16_t offset = static_cast<uint16_t>(2U * axis);
    const uint16_t least = static_cast<uint16_t>(
        card_u16(static_cast<uint16_t>(offsetof(CardHead, servo_min_us) + offset)) *
        core::kTicksPerUs);
    const uint16_t most = static_cast<uint16_t>(
        card_u16(static_cast<uint16_t>(offsetof(CardHead, servo_max_us) + offset)) *
        core::kTicksPerUs);
    const uint16_t shown_least = travel_.least_ticks(axis);
    const uint16_t shown_most = travel_.most_ticks(axis);
    memory_->least_ticks[axis] = shown_least > least ? shown_least : least;
    memory_->most_ticks[axis] = shown_most < most ? shown_most : most;
  }
}

uint16_t TestInputs::added(uint8_t servo, uint16_t base_ticks, Outlet& outlet) const {
  const InputMemory* const memory = outlet.lend();
  if (servo >= core::kCardAxes || memory == nullptr || memory_ == nullptr || base_ticks == 0) {
    return base_ticks;
  }
  const int16_t deflection = memory->applied_ticks[servo];
  if (deflection == 0) return base_ticks;
  return deflection > 0 ? core::add_up_to(base_ticks, deflection, memory_->most_ticks[servo])
                        : core::add_down_to(base_ticks, deflection, memory_->least_ticks[servo]);
}

// Throttle idle, switch at direct, aileron and rudder held at their ends: nobody flies so, and
// neither button nor throttle, which start and stop a recording, has a part in it.
void TestInputs::step_slow(const PilotLink& pilot,
                           const Sensors& sensors,
                           core::FlightState flight,
                           const frames::ConfigFrame& config,
                           Outlet& outlet,
                           uint32_t now_us) {
  if (rows_ == 0) return;
  const core::RcChannels& rc = pilot.channels();
  if (command_.enabled()) {
    tell_card(outlet, now_us);
    if (memory_ == nullptr) look_for_flight(sensors, now_us);
  }
  if (flight != core::FlightState::kGround) return;
  travel_.look(rc);
  const bool resting =
      rc.steady == (1U << core::kChannels) - 1U &&
      rc.width_ticks[core::kSwitch] <= config.switch_direct_max_us * core::kTicksPerUs &&
      rc.width_ticks[core::kThrottle] <= config.throttle_idle_max_us * core::kTicksPerUs &&
      travel_.shown();
  if (command_.enabled()) {
    // One at a time: what is shown of one axis is no time of the other.
    const bool aileron = tilted(core::kAileron, rc, sensors);
    const bool shown = resting && aileron != tilted(core::kElevator, rc, sensors);
    if (sign_.look(shown, now_us)) {
      prove(aileron ? core::kAileron : core::kElevator, rc, outlet, now_us);
    }
    return;
  }
  const bool sign = resting && hash_shown_ &&
                    travel_.at_end(core::kAileron, rc.width_ticks[core::kAileron]) &&
                    travel_.at_end(core::kRudder, rc.width_ticks[core::kRudder]);
  if (sign_.look(sign, now_us)) enable(sensors, outlet, now_us);
}

// Right wing down with the aileron at its end, or nose up with the elevator at its end: the stick
// that a pilot gives against it.
bool TestInputs::tilted(uint8_t axis, const core::RcChannels& rc, const Sensors& sensors) const {
  if (!travel_.at_end(axis, rc.width_ticks[axis]) || card_hold_part() == 0) return false;
  core::InputReadings in;
  sensors.imu_readings(&in);
  return in.imu && (axis == core::kAileron ? in.phi : in.theta) >= kTilt;
}

// What the stick did is what the card's gain must do; else the card is refused.
__attribute__((noinline)) void TestInputs::prove(uint8_t axis,
                                                 const core::RcChannels& rc,
                                                 Outlet& outlet,
                                                 uint32_t now_us) {
  const uint16_t at = static_cast<uint16_t>(card_hold_part() * frames::kCardPartBytes);
  const size_t field = offsetof(frames::CardHoldLayout, angle_gain);
  const int16_t gain =
      static_cast<int16_t>(card_u16(static_cast<uint16_t>(at + field + 2U * axis)));
  const bool raises = !travel_.above_middle(axis, rc.width_ticks[axis]);
  outlet.event(Event::kHoldSense, axis | static_cast<uint32_t>(raises) << 8, now_us);
  if (raises == (gain > 0)) {
    senses_ = static_cast<uint8_t>(senses_ | 1U << axis);
    beeps_ = kEnabledBeeps;
    return;
  }
  command_.disable();
  beeps_ = beeps_of(InputEnd::kHoldSense);
  outlet.event(Event::kCardRefused, static_cast<uint32_t>(CardFault::kHold), now_us);
}

void TestInputs::enable(const Sensors& sensors, Outlet& outlet, uint32_t now_us) {
  core::InputReadings in;
  sensors.input_readings(&in, now_us);
  const bool far_watched = card_u16(offsetof(CardHead, distance_max_m)) != 0;
  if (in.static_pressure == 0 || (far_watched && !in.gps)) {
    beeps_ = beeps_of(InputEnd::kSensorLost);
    outlet.event(Event::kCardRefused, static_cast<uint32_t>(CardFault::kNotValid), now_us);
    return;
  }
  home_.pressure_2pa = static_cast<uint16_t>(in.static_pressure >> (kPaShift + 1U));
  home_.latitude = in.latitude;
  home_.longitude = in.longitude;
  home_.cosine = core::home_cosine(in.latitude);
  uint8_t airspeed_input;
  read_card(offsetof(CardHead, airspeed_input), &airspeed_input, sizeof airspeed_input);
  flying_.tare(airspeed_input, card_u16(offsetof(CardHead, dp_min)), in, now_us);
  command_.enable();
  senses_ = 0;
  told_ = 0;
  beeps_ = kEnabledBeeps;
  outlet.event(Event::kCardEnabled, card_hash(), now_us);
}

// One frame of it at a time, where the ring has room to spare.
void TestInputs::tell_card(Outlet& outlet, uint32_t now_us) {
  if (!outlet.logging()) {
    told_ = 0;
    return;
  }
  const uint8_t all = static_cast<uint8_t>(kConfigFrames + card_parts());
  if (told_ >= all || running() || !outlet.quiet()) return;
  if (told_ < kConfigFrames) {
    outlet.put(frames::InputConfigFrame{now_us, armed_min_us_});
  } else {
    frames::CardFrame frame;
    frame.t_us = now_us;
    frame.part = static_cast<uint8_t>(told_ - kConfigFrames);
    read_card_part(frame.part, frame.bytes);
    outlet.put(frame);
  }
  ++told_;
}

}  // namespace app
