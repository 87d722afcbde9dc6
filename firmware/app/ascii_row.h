// The row of the original logger's second flight, for its ground station: 26 readings, a zero
// trailer and CR, five a second at most. Values are those the original computed, without its
// overflows; 500 is "no value", as its station reads it. Its constants are the thesis's, wrong ones
// too: the station undoes them.
#pragma once

#include <stdint.h>

#include "app/sensors.h"
#include "app/telemetry.h"
#include "app/text_out.h"
#include "core/every.h"

namespace app {

class AsciiRow {
 public:
  static constexpr uint32_t kPeriodUs = 200000UL;
  static constexpr uint16_t kLongestRow = 360;

  void start(uint32_t now_us) { turn_.start(now_us); }
  // One reading per call, as the port has room; a row begins only if the budget allows all of it.
  void step(const Sensors& sensors,
            const core::RcChannels& rc,
            Telemetry& telemetry,
            uint32_t now_us);

 private:
  static constexpr uint8_t kReadings = 26;

  void reading(const Sensors& sensors, const core::RcChannels& rc);
  void attitude(int16_t angle);
  void imu(const frames::IdentFrame& ident, uint8_t axis);
  void position(const Sensors& sensors, uint8_t which);
  void surface(const core::RcChannels& rc, uint8_t channel);

  TextOut out_{hal::Port::kTelemetry};
  core::Every turn_;
  const char* label_ = nullptr;
  uint8_t next_ = kReadings + 1;  // behind the trailer: between two rows
};

// Pressure altitude in the standard atmosphere; INT16_MIN beyond 20 to 110 kPa.
int16_t pressure_altitude_m(uint32_t static_pressure_16th_pa);

// Airspeed in 0.01 km/h from the sum of four conversions of an MPXV7002DP at 5 V, sea level.
uint16_t airspeed_centi_kmph(uint16_t sum);

}  // namespace app
