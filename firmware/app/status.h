// One readable line on USB each second while nothing is recorded: what is there, and what it says.
#pragma once

#include <stdint.h>

#include "app/recorder.h"
#include "app/text_out.h"
#include "core/every.h"

namespace app {

class Status {
 public:
  void start(uint32_t now_us);
  // One part of the line per call, as the port has room.
  void step(const Recorder& recorder,
            const Sensors& sensors,
            const PilotLink& pilot,
            uint32_t now_us);

 private:
  enum class Part : uint8_t { kName, kImu, kBaro, kGps, kReceiver, kServos, kCard, kSupply, kIdle };

  void imu(const Sensors& sensors);
  void baro(const Sensors& sensors);
  void gps(const Sensors& sensors);
  void receiver(const PilotLink& pilot);
  void card(const Recorder& recorder);

  TextOut out_{hal::Port::kUsb};
  core::Every turn_;
  Part part_ = Part::kIdle;
};

}  // namespace app
