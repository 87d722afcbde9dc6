#include "app/sensors.h"

#include "core/bytes.h"
#include "hal/analog_input.h"
#include "hal/clock.h"
#include "hal/imu_bus.h"
#include "hal/relay.h"
#include "hal/serial.h"

namespace app {

namespace {

constexpr uint32_t kBaroUs = 40000UL;
constexpr uint32_t kMagUs = 1000000UL / 15U;
constexpr uint32_t kAttitudeUs = 100000UL;
constexpr uint32_t kImuSilentUs = 100000UL;
constexpr int32_t kScanDeadUs = 2L * hal::kScanUs;
constexpr uint32_t kScanAheadUs = 1000;
constexpr uint32_t kGpsSilentUs = 2000000UL;

// An open or shorted sensor sits within two counts of a rail (sums of four conversions).
constexpr uint16_t kRailCounts = 2U * hal::kAnalogRounds;
constexpr uint16_t kFullSum = 1023U * hal::kAnalogRounds;

bool usable(uint16_t sum) {
  return sum >= kRailCounts && sum <= kFullSum - kRailCounts;
}

// A scan may begin some microseconds behind the packet that tells of it.
uint32_t age_us(uint32_t since_us, uint32_t now_us) {
  const uint32_t age = now_us - since_us;
  return since_us - now_us < kScanAheadUs ? 0 : age;
}

}  // namespace

void Sensors::start(const frames::ConfigFrame& config, uint32_t now_us) {
  hal::start_imu_bus();
  hal::start_baro_bus();
  hal::start_analog();
  trigger_.start(config.rate_hz, now_us);
  arm();
  baro_turn_.start(now_us);
  mag_turn_.start(now_us);
  attitude_turn_.start(now_us);
  imu_heard_us_ = now_us;
  gps_heard_us_ = now_us;
}

void Sensors::step(const frames::ConfigFrame& config,
                   const PilotLink& pilot,
                   Outlet& outlet,
                   uint32_t now_us) {
  if (hal::imu_packet_waits()) {
    step_imu(pilot, outlet);
    now_us = hal::now_us();  // the packet may be younger than this turn
  }
  step_ident(pilot, outlet, now_us);
  step_baro(outlet, now_us);
  ++slot_;
  if ((slot_ & 1U) == 0) step_gps(config, outlet, now_us);
  if ((slot_ & 3U) == 1) watch_imu(outlet, now_us);
}

// Not in step(): most turns have no packet, and saving its registers took 0.3 % of the chip.
__attribute__((noinline)) void Sensors::step_imu(const PilotLink& pilot, Outlet& outlet) {
  const uint32_t now_us = hal::now_us();
  while (hal::imu_packet_waits()) {
    const hal::ImuPacket* const packet = hal::imu_packet();
    // Of a packet that started a scan a frame is made before the next packet is looked at.
    const bool scan = packet->scan_after_us != 0;
    if (scan && scanning_) finish_ident(outlet);
    const uint32_t start_us = packet->start_us;
    const uint32_t scan_us = start_us + packet->scan_after_us;
    if (scan) scan_us_ = scan_us;
    const core::ImuResult result =
        imu_.packet(packet->address, packet->bytes, packet->length, start_us);
    hal::release_imu_packet();
    const bool good = result == core::ImuResult::kSample;
    if (good) imu_fresh_ = true;
    if (good && !imu_.sample().original) {
      trigger_.imu_packet(imu_.sample().seq, start_us, scan);
      if (scan) begin_ident(pilot, scan_us, true);
    } else if (scan && trigger_.bad_packet(start_us)) {
      begin_ident(pilot, scan_us, true);
    }
    if (scan || trigger_.mask() != armed_mask_) arm();
    if (result == core::ImuResult::kBad) continue;
    imu_heard_us_ = start_us;
    if (!good) continue;
    const core::ImuSample& sample = imu_.sample();
    hear(sample.original ? frames::kSensorsImuOriginal : frames::kSensorsImu);
    if (!imu_present_) outlet.event(frames::Event::kImuFound, sample.original ? 1U : 0U, now_us);
    imu_present_ = true;
    if (imu_.take_restarted()) outlet.event(frames::Event::kImuRestarted, 0, now_us);
  }
  frames::MagFrame mag;
  if (imu_.take_mag(mag) && mag_turn_.due(now_us, kMagUs)) outlet.put(mag);
  frames::AttitudeFrame attitude;
  if (imu_.take_attitude(attitude) && attitude_turn_.due(now_us, kAttitudeUs)) {
    outlet.put(attitude);
  }
}

void Sensors::arm() {
  armed_mask_ = trigger_.mask();
  hal::arm_scan(armed_mask_);
}

void Sensors::watch_imu(Outlet& outlet, uint32_t now_us) {
  const uint32_t silent_us = now_us - imu_heard_us_;
  if (static_cast<int32_t>(silent_us) < static_cast<int32_t>(kImuSilentUs)) return;
  if (imu_present_) {
    imu_present_ = false;
    outlet.event(frames::Event::kImuLost, silent_us / 1000U, now_us);
  }
  hal::restart_imu_bus();
  imu_heard_us_ = now_us;
}

void Sensors::step_ident(const PilotLink& pilot, Outlet& outlet, uint32_t now_us) {
  bool done = hal::scan_done();
  const bool dead = !done && static_cast<int32_t>(now_us - scan_us_) >= kScanDeadUs;
  if (dead) {
    hal::start_analog();
    arm();
    done = true;
  }
  // A converter that is dead costs the analogue values of the frame and nothing else of it.
  if (done && scanning_) finish_ident(outlet);
  if (dead) rail_ = frames::kSystemRailInvalid;
  const core::IdentTrigger::Source source = trigger_.poll(now_us, done);
  if (source == core::IdentTrigger::Source::kNone) return;
  uint32_t t_us = 0;
  const bool started = hal::start_scan(&t_us);
  arm();
  if (started) scan_us_ = t_us;
  if (started) begin_ident(pilot, t_us, source == core::IdentTrigger::Source::kImu);
}

void Sensors::begin_ident(const PilotLink& pilot, uint32_t t_us, bool imu_triggered) {
  scanning_ = true;
  const core::ImuSample& sample = imu_.sample();
  ident_.t_us = t_us;
  ident_.count = static_cast<uint16_t>(ident_.count + 1U);
  ident_.imu_age = imu_.age_4us(t_us);
  ident_.imu_seq = sample.seq;
  ident_.p = sample.p;
  ident_.q = sample.q;
  ident_.r = sample.r;
  ident_.ax = sample.ax;
  ident_.ay = sample.ay;
  ident_.az = sample.az;
  ident_.phi = sample.phi;
  ident_.theta = sample.theta;
  ident_.psi = sample.psi;
  ident_.servo_aileron = pilot.servo_ticks(core::kAileron);
  ident_.servo_elevator = pilot.servo_ticks(core::kElevator);
  ident_.servo_rudder = pilot.servo_ticks(core::kRudder);
  ident_.servo_throttle = pilot.servo_ticks(core::kThrottle);
  const core::RcChannels& rc = pilot.channels();
  ident_.rc_aileron = rc.width_ticks[core::kAileron];
  ident_.rc_elevator = rc.width_ticks[core::kElevator];
  ident_.rc_rudder = rc.width_ticks[core::kRudder];
  ident_.rc_throttle = rc.width_ticks[core::kThrottle];
  ident_.rc_switch = rc.width_ticks[core::kSwitch];
  uint16_t valid = 0;
  const bool attitude = sample.original ? sample.phi != frames::kIdentPhiInvalid
                                        : (sample.flags & frames::kImuFlagsAttitudeValid) != 0;
  if (imu_fresh_) valid |= frames::kValidImuFresh;
  if (sample.unsaturated) valid |= frames::kValidImuUnsaturated;
  if (attitude) valid |= frames::kValidAttitude;
  if (imu_triggered) valid |= frames::kValidImuTriggered;
  if (sample.original) valid |= frames::kValidImuOriginal;
  if (hal::relay_engaged()) valid |= frames::kValidMegaDrives;
  ident_.valid = valid;
  imu_fresh_ = false;
}

void Sensors::finish_ident(Outlet& outlet) {
  scanning_ = false;
  static_assert(offsetof(frames::IdentFrame, pot_rudder) ==
                    offsetof(frames::IdentFrame, alpha_a) + 2U * (hal::kAnalogRail - 1U),
                "the fields stand in the order of the slots");
  uint8_t* field = reinterpret_cast<uint8_t*>(&ident_) + offsetof(frames::IdentFrame, alpha_a);
  // The first ten bits of `valid` are the slots in their order.
  static_assert(frames::kValidPotRudder == 1U << (hal::kAnalogRail - 1), "slots and bits agree");
  uint16_t valid = ident_.valid;
  uint16_t bit = 1;
  for (uint8_t slot = 0; slot < hal::kAnalogRail; ++slot) {
    const uint16_t sum = hal::scan_sum(slot);
    core::put_le(field, sum);
    field += sizeof sum;
    if (usable(sum)) valid = static_cast<uint16_t>(valid | bit);
    bit = static_cast<uint16_t>(bit << 1);
  }
  ident_.valid = valid;
  analog_ = valid;
  rail_ = hal::scan_sum(hal::kAnalogRail);
  outlet.put(ident_);
}

void Sensors::step_baro(Outlet& outlet, uint32_t now_us) {
  if (baro_turn_.due(now_us, kBaroUs)) barometer_.measure();
  switch (barometer_.poll(now_us)) {
    case drivers::BaroEvent::kNone:
      return;
    case drivers::BaroEvent::kFound:
      tell_baro(outlet, now_us);
      return;
    case drivers::BaroEvent::kLost:
      outlet.event(frames::Event::kBaroLost, static_cast<uint32_t>(barometer_.status()), now_us);
      return;
    case drivers::BaroEvent::kValue:
      if (barometer_.frame().static_pressure != frames::kBaroStaticPressureInvalid) {
        hear(frames::kSensorsBaro);
      }
      outlet.put(barometer_.frame());
      return;
  }
}

void Sensors::step_gps(const frames::ConfigFrame& config, Outlet& outlet, uint32_t now_us) {
  if (config.gps_source == static_cast<uint8_t>(frames::GpsSource::kUbx)) {
    ublox_.poll(gps_.messages(), now_us);
    uint8_t byte = 0;
    while (hal::take_byte(hal::Port::kGps, &byte)) {
      if (gps_.byte(byte, now_us)) gps_heard(gps_.frame(), outlet, now_us);
    }
  } else if (config.gps_source == static_cast<uint8_t>(frames::GpsSource::kOriginalImu)) {
    if (imu_.take_position(gps_.other_source())) gps_heard(gps_.frame(), outlet, now_us);
  }
  const uint32_t silent_us = now_us - gps_heard_us_;
  if (gps_present_ && static_cast<int32_t>(silent_us) >= static_cast<int32_t>(kGpsSilentUs)) {
    gps_present_ = false;
    outlet.event(frames::Event::kGpsLost, 0, now_us);
  }
}

void Sensors::gps_heard(const frames::GpsFrame& frame, Outlet& outlet, uint32_t now_us) {
  gps_heard_us_ = now_us;
  hear(frames::kSensorsGps);
  if (!gps_present_) outlet.event(frames::Event::kGpsFound, 0, now_us);
  gps_present_ = true;
  if (frame.week != frames::kGpsWeekInvalid && frame.fix >= 2) {
    date_week_ = frame.week;
    date_itow_ms_ = frame.itow_ms;
  }
  outlet.put(frame);
}

// Apart, so that its frame stands on the stack for as long as it is made.
__attribute__((noinline)) void Sensors::tell_baro(Outlet& outlet, uint32_t now_us) const {
  outlet.event(frames::Event::kBaroFound, barometer_.chip_id(), now_us);
  frames::BaroCoefficientsFrame words;
  if (coefficients(&words, now_us)) outlet.put(words);
}

uint32_t Sensors::fat_date() const {
  return date_week_ == frames::kGpsWeekInvalid ? 0 : core::fat_time(date_week_, date_itow_ms_);
}

bool Sensors::coefficients(frames::BaroCoefficientsFrame* out, uint32_t now_us) const {
  if (!barometer_.present()) return false;
  barometer_.coefficients(*out);
  out->t_us = now_us;
  return true;
}

void Sensors::airborne_inputs(core::AirborneInputs* out) const {
  const core::ImuSample& sample = imu_.sample();
  out->rates[0] = sample.p;
  out->rates[1] = sample.q;
  out->rates[2] = sample.r;
  out->force[0] = sample.ax;
  out->force[1] = sample.ay;
  out->force[2] = sample.az;
  out->imu = imu_present_;
  out->imu_original = sample.original;
  out->pitot[0] = ident_.dp_a;
  out->pitot[1] = ident_.dp_b;
  static_assert(frames::kValidDpB == frames::kValidDpA << 1, "a bit per pitot");
  out->pitots =
      static_cast<uint8_t>((analog_ & (frames::kValidDpA | frames::kValidDpB)) / frames::kValidDpA);
  const frames::GpsFrame& gps = gps_.frame();
  out->gps = gps_present_ && gps.fix >= static_cast<uint8_t>(frames::GpsFix::kFix2d) &&
             gps.ground_speed != frames::kGpsGroundSpeedInvalid;
  out->ground_speed_cmps = gps.ground_speed;
  out->static_pressure = barometer_.present() ? barometer_.frame().static_pressure : 0;
}

void Sensors::input_readings(core::InputReadings* out, uint32_t now_us) const {
  imu_readings(out);
  scan_readings(out);
  baro_readings(out);
  gps_readings(out);
  ages(out, now_us);
}

void Sensors::imu_readings(core::InputReadings* out) const {
  const core::ImuSample& sample = imu_.sample();
  out->rates[0] = sample.p;
  out->rates[1] = sample.q;
  out->rates[2] = sample.r;
  out->force[0] = sample.ax;
  out->force[1] = sample.ay;
  out->force[2] = sample.az;
  out->phi = sample.phi;
  out->theta = sample.theta;
  // Of an original packet neither scale nor age is known.
  out->imu = imu_present_ && !sample.original && sample.unsaturated &&
             (sample.flags & frames::kImuFlagsAttitudeValid) != 0;
}

void Sensors::scan_readings(core::InputReadings* out) const {
  out->alpha[0] = ident_.alpha_a;
  out->alpha[1] = ident_.alpha_b;
  out->beta[0] = ident_.beta_a;
  out->beta[1] = ident_.beta_b;
  out->pitot[0] = ident_.dp_a;
  out->pitot[1] = ident_.dp_b;
  out->valid = analog_;
  out->rail = rail_;
}

void Sensors::baro_readings(core::InputReadings* out) const {
  out->static_pressure = barometer_.present() ? barometer_.frame().static_pressure : 0;
}

void Sensors::gps_readings(core::InputReadings* out) const {
  const frames::GpsFrame& gps = gps_.frame();
  out->latitude = gps.latitude;
  out->longitude = gps.longitude;
  const bool fix = gps_present_ && gps.fix >= static_cast<uint8_t>(frames::GpsFix::kFix2d);
  const bool speed = fix && gps.ground_speed != frames::kGpsGroundSpeedInvalid;
  out->ground_speed_cmps = speed ? gps.ground_speed : uint16_t{0};
  out->gps = fix && gps.latitude != frames::kGpsLatitudeInvalid &&
             gps.longitude != frames::kGpsLongitudeInvalid;
}

// Of what is not there any more as old as can be.
void Sensors::ages(core::InputReadings* out, uint32_t now_us) const {
  out->imu_age_us = imu_present_ ? age_us(imu_.sample().start_us, now_us) : UINT32_MAX;
  out->scan_age_us = age_us(ident_.t_us, now_us);
  out->baro_age_us = barometer_.present() ? age_us(barometer_.frame().t_us, now_us) : UINT32_MAX;
  out->gps_age_us = gps_present_ ? age_us(gps_heard_us_, now_us) : UINT32_MAX;
}

void Sensors::put_health(frames::SystemFrame* out) {
  heard_ = hearing_;
  hearing_ = 0;
  out->imu_packets = imu_.good();
  out->imu_bad_packets = static_cast<uint16_t>(imu_.bad() + hal::lost_imu_packets());
  out->imu_lost = imu_.lost();
  out->baro_errors = barometer_.errors();
  out->gps_errors = gps_.errors();
  out->ticks_late = trigger_.late();
  out->rail = rail_;
  out->sensors = static_cast<uint8_t>(out->sensors | heard_);
}

}  // namespace app
