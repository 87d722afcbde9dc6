// One readable line on USB each second while nothing is recorded: what is there, and what it says.
#pragma once

#include <stdint.h>

#include "app/recorder.h"
#include "app/text_out.h"
#include "app/usb_channels.h"
#include "core/every.h"

namespace app {

class Status {
 public:
  // Board, version and hash of the image: the boot line, and the head of every other.
  static void name(TextOut* out);
  void start(uint32_t now_us);
  // Every 10 ms or so: asks for the next line.
  void poll(bool recording, UsbChannels& channels, uint32_t now_us);

  bool has_line() const { return part_ != Part::kIdle; }
  // One part of the line per call, as the port has room; false if nothing was written.
  bool step(const Recorder& recorder,
            const Sensors& sensors,
            const PilotLink& pilot,
            uint16_t reference_mv,
            TestInputs& inputs,
            UsbChannels& channels,
            uint32_t now_us);

 private:
  enum class Part : uint8_t {
    kName,
    kImu,
    kVanes,
    kPitots,
    kBaro,
    kGps,
    kReceiver,
    kServos,
    kRelay,
    kInputs,
    kCard,
    kRail,
    kSupply,
    kIdle,
    kAskedFor
  };

  // Writes " missing", or " stale" if it was there; true if there is a value to write.
  bool found(const Sensors& sensors, uint8_t bits);
  void imu(const Sensors& sensors);
  // The counts of `count` analogue channels from a slot on, "-" for one that is open or shorted.
  void analog(const char* name, const Sensors& sensors, uint8_t slot, uint8_t count);
  void rail(uint16_t sum, uint16_t supply_mv);
  void baro(const Sensors& sensors);
  void gps(const Sensors& sensors);
  void receiver(const PilotLink& pilot);
  void card(const Recorder& recorder);
  void work(const Recorder& recorder);
  void inputs(TestInputs& inputs);

  TextOut out_{hal::Port::kUsb};
  core::Every turn_;
  Part part_ = Part::kIdle;
};

}  // namespace app
