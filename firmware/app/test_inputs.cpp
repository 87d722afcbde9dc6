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

constexpr uint8_t kOthersOffset = offsetof(CardHead, airspeed_input);
constexpr uint8_t kImuOffset = offsetof(CardHead, phi_max);
constexpr uint8_t kMoreOffset = offsetof(CardHead, height_min_pa);
constexpr uint8_t kEndOffset = offsetof(CardHead, servo_min_us);
constexpr uint8_t kLeastRateHz = 100;  // slower frames tell of a limit too late
constexpr uint16_t kWatchUs = 5000;    // ages grow without any news
constexpr uint8_t kPaShift = 4;
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

// Of the head the fields from an offset to another; the rest is left as it is.
void read_limits(CardHead* head, uint8_t from, uint8_t to) {
  read_card(from, reinterpret_cast<uint8_t*>(head) + from, static_cast<uint8_t>(to - from));
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
    const bool before = command_.uses_memory();
    const bool triggered =
        command_.trigger(facts.place, pilot.drive == frames::Drive::kMega, now_us);
    InputMemory* const memory = outlet.lend();
    if (command_.uses_memory() && !before) {
      // Nothing is known of the sensors yet.
      outside_ = InputEnd::kSensorLost;
      if (memory != nullptr) memory->watch_start(now_us);
    }
    if (!triggered) return;
  }
  facts.frame_us = pilot.decoder->frame_us();
  facts.silent_us = pilot.decoder->oldest_us(hal::now_ticks());
  facts.stick_us = card_u16(offsetof(CardHead, stick_us));
  facts.dropped = outlet.dropped();
  facts.contact = hal::relay_engaged();
  facts.button = hal::button_pressed();
  facts.throttle_idle = channels.width_ticks[core::kThrottle] <=
                        static_cast<uint32_t>(config.throttle_idle_max_us) * core::kTicksPerUs;
  facts.supply = pilot.supply_good;
  InputMemory* const memory = outlet.lend();
  facts.records = memory != nullptr && config.rate_hz >= kLeastRateHz;
  if (!command_.running()) {
    begin(memory, facts, outlet, now_us);
    return;
  }
  InputEnd why = memory == nullptr ? InputEnd::kRecorder : command_.keeps(*memory, facts, now_us);
  if (why == InputEnd::kButton) button_spent_ = true;
  if (why == InputEnd::kDone && !command_.over(*memory, now_us)) {
    command_.steer(*memory, card_u16(offsetof(CardHead, rate_max_usps)), now_us);
    return;
  }
  finish(why, outlet, now_us);
}

void TestInputs::begin(InputMemory* memory,
                       const InputFacts& facts,
                       Outlet& outlet,
                       uint32_t now_us) {
  InputEnd why = InputCommand::passes(facts);
  if (why == InputEnd::kDone && !facts.contact) why = InputEnd::kRelay;
  if (why == InputEnd::kDone) why = outside_;
  if (why == InputEnd::kDone && !travel_.shown()) why = InputEnd::kTravel;
  if (why == InputEnd::kDone) why = load_row(memory);
  const uint8_t row = command_.row();
  if (why != InputEnd::kDone) {
    command_.refuse();
    beeps_ = beeps_of(why);
    outlet.event(Event::kInputRefused, row | static_cast<uint32_t>(why) << 8, now_us);
    return;
  }
  command_.start(*memory, facts, now_us);
  frames::CardFrame frame;
  frame.t_us = now_us;
  frame.part = static_cast<uint8_t>(frames::kCardHeadParts + row);
  memcpy(frame.bytes, &memory->row, sizeof frame.bytes);
  outlet.put(frame);
  outlet.event(Event::kInputStart, row | card_hash() << 8, now_us);
}

InputEnd TestInputs::load_row(InputMemory* memory) const {
  core::RowLimits limits;
  for (uint8_t axis = 0; axis < core::kCardAxes; ++axis) {
    limits.amplitude_max_us[axis] =
        card_u16(static_cast<uint16_t>(offsetof(CardHead, amplitude_max_us) + 2U * axis));
  }
  limits.frequency_max_chz = card_u16(offsetof(CardHead, frequency_max_chz));
  read_card_row(command_.row(), &memory->row);
  return core::judge_row(memory->row, limits) == CardFault::kNone ? InputEnd::kDone
                                                                  : InputEnd::kRowDamaged;
}

bool TestInputs::watch_sensors(const Sensors& sensors, Outlet& outlet, uint32_t now_us) {
  InputMemory* const memory = outlet.lend();
  if (memory == nullptr) {
    if (!command_.running()) return false;
    finish(InputEnd::kRecorder, outlet, now_us);
    return true;
  }
  const uint8_t frames = outlet.frames();
  const uint8_t seq = sensors.imu().seq;
  const uint16_t now = static_cast<uint16_t>(now_us);
  const bool news = frames != memory->frames_seen || seq != memory->imu_seq;
  if (!news && static_cast<uint16_t>(now - memory->watched_us) < kWatchUs) return false;
  // Frames come each 10 or 5 ms, and tell of all but the packets.
  const bool others = frames != memory->frames_seen;
  memory->frames_seen = frames;
  memory->imu_seq = seq;
  memory->watched_us = now;
  CardHead limits;
  core::InputReadings in;
  sensors.input_readings(&in, hal::now_us());
  read_limits(&limits, kImuOffset, kMoreOffset);
  InputEnd why = core::judge_imu(limits, in);
  if (others) {
    read_limits(&limits, kOthersOffset, kImuOffset);
    read_limits(&limits, kMoreOffset, kEndOffset);
    memory->motion.look(limits, in, now_us);
    outside_ = core::judge_others(limits, in, home_, memory->motion, now_us);
  }
  if (why == InputEnd::kDone) why = outside_;
  outside_ = why;
  if (why == InputEnd::kDone || !command_.running()) return false;
  finish(outside_, outlet, now_us);
  return true;
}

void TestInputs::finish(InputEnd why, Outlet& outlet, uint32_t now_us) {
  const uint32_t ms = (now_us - command_.since_us()) / 1000U;
  const uint8_t row = command_.row();
  command_.end(rows_);
  beeps_ = beeps_of(why);
  outlet.event(Event::kInputEnd, row | static_cast<uint32_t>(why) << 8 | ms << 16, now_us);
}

uint16_t TestInputs::added(uint8_t servo, uint16_t base_ticks, Outlet& outlet) const {
  const InputMemory* const memory = outlet.lend();
  if (servo >= core::kCardAxes || memory == nullptr || base_ticks == 0) return base_ticks;
  const int16_t deflection = memory->applied_ticks[servo];
  if (deflection == 0) return base_ticks;
  const uint16_t offset = static_cast<uint16_t>(2U * servo);
  if (deflection > 0) {
    const uint16_t most = static_cast<uint16_t>(
        card_u16(static_cast<uint16_t>(offsetof(CardHead, servo_max_us) + offset)) *
        core::kTicksPerUs);
    const uint16_t shown = travel_.most_ticks(servo);
    return core::add_up_to(base_ticks, deflection, shown < most ? shown : most);
  }
  const uint16_t least = static_cast<uint16_t>(
      card_u16(static_cast<uint16_t>(offsetof(CardHead, servo_min_us) + offset)) *
      core::kTicksPerUs);
  const uint16_t shown = travel_.least_ticks(servo);
  return core::add_down_to(base_ticks, deflection, shown > least ? shown : least);
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
  }
  if (flight != core::FlightState::kGround) return;
  travel_.look(rc);
  const bool sign =
      !command_.enabled() && hash_shown_ && rc.steady == (1U << core::kChannels) - 1U &&
      rc.width_ticks[core::kSwitch] <= config.switch_direct_max_us * core::kTicksPerUs &&
      rc.width_ticks[core::kThrottle] <= config.throttle_idle_max_us * core::kTicksPerUs &&
      travel_.shown() && travel_.at_end(core::kAileron, rc.width_ticks[core::kAileron]) &&
      travel_.at_end(core::kRudder, rc.width_ticks[core::kRudder]);
  if (sign_.look(sign, now_us)) enable(sensors, outlet, now_us);
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
  command_.enable();
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
  const uint8_t all = static_cast<uint8_t>(kConfigFrames + frames::kCardHeadParts + rows_);
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
