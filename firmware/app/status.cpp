#include "app/status.h"

#include "app/version.h"
#include "core/progmem.h"
#include "hal/analog_input.h"
#include "hal/system.h"

namespace app {

namespace {

constexpr uint32_t kLineUs = 1000000UL;
constexpr uint16_t kLongestPart = 48;

constexpr char kMissing[] CORE_FLASH = " missing";
constexpr char kImuText[] CORE_FLASH = " | imu";
constexpr char kImuNew[] CORE_FLASH = " ok";
constexpr char kImuOriginal[] CORE_FLASH = " original";
constexpr char kBaroText[] CORE_FLASH = " | baro";
constexpr char kPascal[] CORE_FLASH = " Pa";
constexpr char kGpsText[] CORE_FLASH = " | gps";
constexpr char kFixText[] CORE_FLASH = " fix ";
constexpr char kSatellites[] CORE_FLASH = " sat ";
constexpr char kReceiverText[] CORE_FLASH = " | rc us";
constexpr char kCardText[] CORE_FLASH = " | card ";
constexpr char kDriveText[] CORE_FLASH = " | drive ";
constexpr char kSupplyText[] CORE_FLASH = " | avcc ";
constexpr char kMillivolt[] CORE_FLASH = " mV\r\n";

constexpr char kTextNoCard[] CORE_FLASH = "missing";
constexpr char kTextNoFat[] CORE_FLASH = "not FAT32";
constexpr char kTextUnreadable[] CORE_FLASH = "unreadable";
constexpr char kTextFull[] CORE_FLASH = "full";
constexpr char kTextFragmented[] CORE_FLASH = "fragmented";
constexpr char kTextUndecided[] CORE_FLASH = "open flight ";
constexpr char kTextReady[] CORE_FLASH = "ready ";
constexpr char kTextLost[] CORE_FLASH = "lost";

constexpr char kDirectBoot[] CORE_FLASH = "direct (boot)";
constexpr char kDirectSwitch[] CORE_FLASH = "direct (switch)";
constexpr char kDirectInvalid[] CORE_FLASH = "direct (switch invalid)";
constexpr char kDirectLost[] CORE_FLASH = "direct (receiver lost)";
constexpr char kDirectTest[] CORE_FLASH = "direct (self-test)";
constexpr char kMega[] CORE_FLASH = "mega";
constexpr char kHolding[] CORE_FLASH = "mega (holding)";

const char* drive_text(frames::Drive drive) {
  switch (drive) {
    case frames::Drive::kDirectBoot:
      return kDirectBoot;
    case frames::Drive::kDirectSwitch:
      return kDirectSwitch;
    case frames::Drive::kDirectSwitchInvalid:
      return kDirectInvalid;
    case frames::Drive::kDirectReceiverLost:
      return kDirectLost;
    case frames::Drive::kDirectSelfTest:
      return kDirectTest;
    case frames::Drive::kMega:
      return kMega;
    case frames::Drive::kMegaHolding:
      return kHolding;
  }
  return kDirectBoot;
}

const char* volume_text(storage::VolumeStatus status) {
  switch (status) {
    case storage::VolumeStatus::kReady:
      return kTextReady;
    case storage::VolumeStatus::kNoCard:
      return kTextNoCard;
    case storage::VolumeStatus::kNoFat:
      return kTextNoFat;
    case storage::VolumeStatus::kUnreadable:
      return kTextUnreadable;
    case storage::VolumeStatus::kFull:
      return kTextFull;
    case storage::VolumeStatus::kFragmented:
      return kTextFragmented;
  }
  return kTextUnreadable;
}

}  // namespace

void Status::start(uint32_t now_us) {
  turn_.start(now_us);
}

void Status::step(const Recorder& recorder,
                  const Sensors& sensors,
                  const PilotLink& pilot,
                  uint32_t now_us) {
  if (part_ == Part::kIdle) {
    if (recorder.recording() || !turn_.due(now_us, kLineUs)) return;
    part_ = Part::kName;
  }
  if (out_.room() < kLongestPart) return;
  switch (part_) {
    case Part::kName:
      out_.ram(hal::board_name());
      out_.letter(' ');
      out_.flash(kVersion);
      break;
    case Part::kImu:
      imu(sensors);
      break;
    case Part::kBaro:
      baro(sensors);
      break;
    case Part::kGps:
      gps(sensors);
      break;
    case Part::kReceiver:
      receiver(pilot);
      break;
    case Part::kServos:
      out_.flash(kDriveText);
      out_.flash(drive_text(pilot.drive()));
      break;
    case Part::kCard:
      card(recorder);
      break;
    case Part::kSupply:
      out_.flash(kSupplyText);
      out_.number(hal::avcc_mv());
      out_.flash(kMillivolt);
      break;
    case Part::kIdle:
      return;
  }
  part_ = static_cast<Part>(static_cast<uint8_t>(part_) + 1U);
}

void Status::imu(const Sensors& sensors) {
  out_.flash(kImuText);
  const uint8_t heard = sensors.heard();
  if ((heard & frames::kSensorsImu) != 0) {
    out_.flash(kImuNew);
  } else {
    out_.flash((heard & frames::kSensorsImuOriginal) != 0 ? kImuOriginal : kMissing);
  }
}

void Status::baro(const Sensors& sensors) {
  out_.flash(kBaroText);
  if ((sensors.heard() & frames::kSensorsBaro) == 0) {
    out_.flash(kMissing);
    return;
  }
  out_.letter(' ');
  out_.number(static_cast<int32_t>(sensors.baro().static_pressure / 16U));
  out_.flash(kPascal);
}

void Status::gps(const Sensors& sensors) {
  out_.flash(kGpsText);
  if ((sensors.heard() & frames::kSensorsGps) == 0) {
    out_.flash(kMissing);
    return;
  }
  out_.flash(kFixText);
  out_.number(sensors.gps().fix);
  out_.flash(kSatellites);
  out_.number(sensors.gps().satellites);
}

void Status::receiver(const PilotLink& pilot) {
  out_.flash(kReceiverText);
  if (pilot.decoder().valid() == 0) {
    out_.flash(kMissing);
    return;
  }
  for (uint8_t channel = 0; channel < core::kChannels; ++channel) {
    out_.letter(' ');
    out_.number(pilot.channels().width_ticks[channel] / core::kTicksPerUs);
  }
}

void Status::card(const Recorder& recorder) {
  out_.flash(kCardText);
  switch (recorder.state()) {
    case Recorder::State::kNoFile:
      out_.flash(volume_text(recorder.volume_status()));
      return;
    case Recorder::State::kFailed:
      out_.flash(kTextLost);
      return;
    case Recorder::State::kUndecided:
      out_.flash(kTextUndecided);
      break;
    case Recorder::State::kReady:
    case Recorder::State::kRecording:
    case Recorder::State::kEnding:
      out_.flash(kTextReady);
      break;
    case Recorder::State::kFileFull:
      out_.flash(kTextFull);
      out_.letter(' ');
      break;
  }
  out_.number(static_cast<int32_t>(recorder.file_number()));
}

}  // namespace app
