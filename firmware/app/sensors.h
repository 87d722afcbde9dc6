// Everything that is measured, made into frames at the rates of frames.toml.
#pragma once

#include <stdint.h>

#include "app/baro_link.h"
#include "app/gps_link.h"
#include "app/outlet.h"
#include "app/pilot_link.h"
#include "core/airborne.h"
#include "core/every.h"
#include "core/gps_receiver.h"
#include "core/ident_trigger.h"
#include "core/imu_receiver.h"
#include "drivers/barometer.h"
#include "drivers/ublox.h"

namespace app {

class Sensors {
 public:
  void start(const frames::ConfigFrame& config, uint32_t now_us);
  void step(const frames::ConfigFrame& config,
            const PilotLink& pilot,
            Outlet& outlet,
            uint32_t now_us);

  // False while there is no pressure sensor.
  bool coefficients(frames::BaroCoefficientsFrame* out, uint32_t now_us) const;
  void put_health(frames::SystemFrame* out);
  // Bits of frames.toml, `sensors`: heard of during the last second.
  uint8_t heard() const { return heard_; }
  uint8_t known() const { return known_; }  // of those, ever since boot
  // Of the last epoch whose date was known, for the file system; 0: none yet.
  uint32_t fat_date() const;
  const frames::BaroFrame& baro() const { return barometer_.frame(); }
  const frames::GpsFrame& gps() const { return gps_.frame(); }
  const frames::IdentFrame& ident() const { return ident_; }
  const core::ImuSample& imu() const { return imu_.sample(); }
  // Of the last scan: the first ten bits of `valid`, neither open nor shorted.
  uint16_t analog() const { return analog_; }
  uint16_t rail() const { return rail_; }
  // What tells of flying or the ground; the receiver's part is left to the caller.
  void input_readings(core::InputReadings* out, uint32_t now_us) const;
  // Parts of it, and the counts by which their news show.
  void imu_readings(core::InputReadings* out) const;
  void scan_readings(core::InputReadings* out) const;
  void baro_readings(core::InputReadings* out) const;
  void gps_readings(core::InputReadings* out) const;
  void ages(core::InputReadings* out, uint32_t now_us) const;
  uint8_t scans() const {
    return static_cast<uint8_t>(scanning_ ? ident_.count - 1U : ident_.count);
  }
  uint16_t gps_heard_us() const { return static_cast<uint16_t>(gps_heard_us_); }  // low half
  void airborne_inputs(core::AirborneInputs* out) const;

 private:
  void step_imu(const PilotLink& pilot, Outlet& outlet);
  void arm();
  void watch_imu(Outlet& outlet, uint32_t now_us);
  void step_ident(const PilotLink& pilot, Outlet& outlet, uint32_t now_us);
  void begin_ident(const PilotLink& pilot, uint32_t t_us, bool imu_triggered);
  void finish_ident(Outlet& outlet);
  void step_baro(Outlet& outlet, uint32_t now_us);
  void tell_baro(Outlet& outlet, uint32_t now_us) const;
  void step_gps(const frames::ConfigFrame& config, Outlet& outlet, uint32_t now_us);
  void gps_heard(const frames::GpsFrame& frame, Outlet& outlet, uint32_t now_us);
  void hear(uint8_t bit) {
    hearing_ = static_cast<uint8_t>(hearing_ | bit);
    known_ = static_cast<uint8_t>(known_ | bit);
  }

  core::ImuReceiver imu_;
  core::IdentTrigger trigger_;
  core::GpsReceiver gps_;
  BaroLink baro_link_;
  drivers::Barometer<BaroLink> barometer_{baro_link_};
  GpsLink gps_link_;
  drivers::Ublox<GpsLink> ublox_{gps_link_};
  core::Every baro_turn_;
  core::Every mag_turn_;
  core::Every attitude_turn_;
  frames::IdentFrame ident_ = {};
  uint32_t scan_us_ = 0;  // the last scan began
  uint32_t imu_heard_us_ = 0;
  uint32_t gps_heard_us_ = 0;
  uint32_t date_itow_ms_ = 0;
  uint16_t date_week_ = frames::kGpsWeekInvalid;
  uint16_t analog_ = 0;
  uint16_t rail_ = 0;
  uint8_t slot_ = 0;
  uint8_t hearing_ = 0;
  uint8_t heard_ = 0;
  uint8_t known_ = 0;
  uint8_t armed_mask_ = 0;
  bool scanning_ = false;
  bool imu_fresh_ = false;
  bool imu_present_ = false;
  bool gps_present_ = false;
};

}  // namespace app
