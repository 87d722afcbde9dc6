#include "app/status.h"

#include "app/card_store.h"
#include "app/version.h"
#include "core/progmem.h"
#include "core/supply.h"
#include "hal/analog_input.h"
#include "hal/relay.h"
#include "hal/system.h"

namespace app {

namespace {

constexpr uint32_t kLineUs = 1000000UL;
constexpr uint16_t kLongestPart = 48;

constexpr uint16_t kRailDivider = 2;  // 10 k over 10 k (hw/pin_map.toml)
constexpr uint16_t kLeastRailSum = 8;

constexpr char kImageText[] CORE_FLASH = " image ";
constexpr char kMissing[] CORE_FLASH = " missing";
constexpr char kStale[] CORE_FLASH = " stale";
constexpr char kImuText[] CORE_FLASH = " | imu";
constexpr char kImuNew[] CORE_FLASH = " ok";
constexpr char kImuOriginal[] CORE_FLASH = " original";
constexpr char kRoll[] CORE_FLASH = " roll ";
constexpr char kPitch[] CORE_FLASH = " pitch ";
constexpr char kDegrees[] CORE_FLASH = " deg";
constexpr char kForce[] CORE_FLASH = " az ";
constexpr char kMilliG[] CORE_FLASH = " mg";
constexpr char kAlphaText[] CORE_FLASH = " | alpha";
constexpr char kBetaText[] CORE_FLASH = " | beta";
constexpr char kPitotText[] CORE_FLASH = " | pitot";
constexpr char kPotText[] CORE_FLASH = " | pots";
constexpr char kOpen[] CORE_FLASH = " -";
constexpr char kBaroText[] CORE_FLASH = " | baro";
constexpr char kPascal[] CORE_FLASH = " Pa";
constexpr char kGpsText[] CORE_FLASH = " | gps";
constexpr char kFixText[] CORE_FLASH = " fix ";
constexpr char kSatellites[] CORE_FLASH = " sat ";
constexpr char kReceiverText[] CORE_FLASH = " | rc us";
constexpr char kRefused[] CORE_FLASH = " refused, ";
constexpr char kHertz[] CORE_FLASH = " Hz";
constexpr char kCardText[] CORE_FLASH = " | card ";
constexpr char kDriveText[] CORE_FLASH = " | drive ";
constexpr char kRelayText[] CORE_FLASH = " | relay ";
constexpr char kReleased[] CORE_FLASH = "released";
constexpr char kEngaged[] CORE_FLASH = "engaged";
constexpr char kStuck[] CORE_FLASH = "stuck";
constexpr char kInputsText[] CORE_FLASH = " | inputs ";
constexpr char kRowsText[] CORE_FLASH = " rows ";
constexpr char kOffText[] CORE_FLASH = " off";
constexpr char kEnabledText[] CORE_FLASH = " enabled";
constexpr char kRailText[] CORE_FLASH = " | rail";
constexpr char kSupplyText[] CORE_FLASH = " | avcc ";
constexpr char kMillivolt[] CORE_FLASH = " mV";
constexpr char kAbout[] CORE_FLASH = "about ";  // the reference was never compared with a meter
constexpr char kLineEnd[] CORE_FLASH = "\r\n";

constexpr char kTextNoCard[] CORE_FLASH = "missing";
constexpr char kTextNoFat[] CORE_FLASH = "not FAT32";
constexpr char kTextUnreadable[] CORE_FLASH = "unreadable";
constexpr char kTextFull[] CORE_FLASH = "full";
constexpr char kTextFragmented[] CORE_FLASH = "fragmented";
constexpr char kTextDamaged[] CORE_FLASH = "damaged";
constexpr char kTextUnrecorded[] CORE_FLASH = ", not recorded";
constexpr char kTextLooking[] CORE_FLASH = "looking";
constexpr char kTextSearching[] CORE_FLASH = "searching ";
constexpr char kTextPreparing[] CORE_FLASH = "preparing ";
constexpr char kTextClosing[] CORE_FLASH = "closing";
constexpr char kTextSmall[] CORE_FLASH = "ready, small ";
constexpr char kPercent[] CORE_FLASH = " %";
constexpr char kTextUndecided[] CORE_FLASH = "open flight ";
constexpr char kTextAwaitsGround[] CORE_FLASH = "waits for the ground";
constexpr char kTextReady[] CORE_FLASH = "ready ";
constexpr char kTextLost[] CORE_FLASH = "lost";

constexpr char kDirectBoot[] CORE_FLASH = "direct (boot)";
constexpr char kDirectSwitch[] CORE_FLASH = "direct (switch)";
constexpr char kDirectInvalid[] CORE_FLASH = "direct (switch invalid)";
constexpr char kDirectLost[] CORE_FLASH = "direct (receiver lost)";
constexpr char kDirectTest[] CORE_FLASH = "direct (self-test)";
constexpr char kDirectRelay[] CORE_FLASH = "direct (relay)";
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
    case frames::Drive::kDirectRelay:
      return kDirectRelay;
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
    case storage::VolumeStatus::kDamaged:
      return kTextDamaged;
  }
  return kTextUnreadable;
}

}  // namespace

void Status::name(TextOut* out) {
  out->flash(hal::board_name());
  out->letter(' ');
  out->flash(kVersion);
  if (hal::image_hash() == 0) return;
  out->flash(kImageText);
  out->hex(hal::image_hash());
}

void Status::start(uint32_t now_us) {
  turn_.start(now_us);
}

void Status::poll(bool recording, UsbChannels& channels, uint32_t now_us) {
  if (part_ < Part::kIdle) return;
  channels.allow(!recording);
  if (recording) {
    part_ = Part::kIdle;
  } else if (turn_.due(now_us, kLineUs)) {
    part_ = Part::kAskedFor;
  }
}

bool Status::step(const Recorder& recorder,
                  const Sensors& sensors,
                  const PilotLink& pilot,
                  uint16_t reference_mv,
                  TestInputs& inputs,
                  UsbChannels& channels,
                  uint32_t now_us) {
  if (out_.room() < kLongestPart) return false;
  if (part_ == Part::kAskedFor) {
    if (!channels.begin_line(now_us)) return false;
    part_ = Part::kName;
    channels.allow(false);
    return true;
  }
  switch (part_) {
    case Part::kName:
      name(&out_);
      break;
    case Part::kImu:
      imu(sensors);
      break;
    case Part::kVanes:
      analog(kAlphaText, sensors, 0, 2);
      analog(kBetaText, sensors, 2, 2);
      break;
    case Part::kPitots:
      analog(kPitotText, sensors, 4, 2);
      analog(kPotText, sensors, 6, 4);
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
    case Part::kRelay:
      out_.flash(kRelayText);
      if (pilot.contact_stuck()) {
        out_.flash(kStuck);
      } else {
        out_.flash(hal::relay_engaged() ? kEngaged : kReleased);
      }
      break;
    case Part::kInputs:
      this->inputs(inputs);
      break;
    case Part::kCard:
      card(recorder);
      break;
    case Part::kRail:
      rail(sensors.rail(), core::supply_mv(hal::avcc_mv(), reference_mv));
      break;
    case Part::kSupply:
      out_.flash(kSupplyText);
      if (reference_mv == 0) out_.flash(kAbout);
      out_.number(core::supply_mv(hal::avcc_mv(), reference_mv));
      out_.flash(kMillivolt);
      out_.flash(kLineEnd);
      channels.allow(true);
      break;
    case Part::kIdle:
    case Part::kAskedFor:
      return false;
  }
  part_ = static_cast<Part>(static_cast<uint8_t>(part_) + 1U);
  // Nothing to say without a card, and no turn spent on it.
  if (part_ == Part::kInputs && inputs.rows() == 0) part_ = Part::kCard;
  return true;
}

void Status::inputs(TestInputs& inputs) {
  out_.flash(kInputsText);
  out_.hex(card_hash());
  out_.flash(kRowsText);
  out_.number(inputs.rows());
  out_.flash(inputs.enabled() ? kEnabledText : kOffText);
  inputs.hash_was_shown();
}

bool Status::found(const Sensors& sensors, uint8_t bits) {
  if ((sensors.heard() & bits) != 0) return true;
  const bool stale = (sensors.known() & bits) != 0;
  out_.flash(stale ? kStale : kMissing);
  return stale;
}

void Status::imu(const Sensors& sensors) {
  out_.flash(kImuText);
  const core::ImuSample& sample = sensors.imu();
  if (!found(sensors, frames::kSensorsImu | frames::kSensorsImuOriginal)) return;
  if ((sensors.heard() & (frames::kSensorsImu | frames::kSensorsImuOriginal)) != 0) {
    out_.flash(sample.original ? kImuOriginal : kImuNew);
  }
  if ((sample.flags & frames::kImuFlagsAttitudeValid) != 0) {
    out_.flash(kRoll);
    out_.number(sample.phi / 100);
    out_.flash(kPitch);
    out_.number(sample.theta / 100);
    out_.flash(kDegrees);
  }
  // The steps of original packets depend on the chip's revision: nothing to say in mg.
  if (sample.original || sample.az == INT16_MIN) return;
  out_.flash(kForce);
  out_.number(static_cast<int32_t>(sample.az) * 125 / 1024);  // 8192 steps per g
  out_.flash(kMilliG);
}

void Status::analog(const char* name, const Sensors& sensors, uint8_t slot, uint8_t count) {
  out_.flash(name);
  const frames::IdentFrame& ident = sensors.ident();
  const uint16_t sums[] = {ident.alpha_a,
                           ident.alpha_b,
                           ident.beta_a,
                           ident.beta_b,
                           ident.dp_a,
                           ident.dp_b,
                           ident.pot_elevator,
                           ident.pot_aileron_left,
                           ident.pot_aileron_right,
                           ident.pot_rudder};
  const uint16_t usable = static_cast<uint16_t>(sensors.analog() >> slot);
  if ((usable & ((1U << count) - 1U)) == 0) {
    out_.flash(kMissing);
    return;
  }
  for (uint8_t i = 0; i < count; ++i) {
    if ((usable >> i & 1U) == 0) {
      out_.flash(kOpen);
      continue;
    }
    out_.letter(' ');
    out_.number(sums[slot + i] / hal::kAnalogRounds);
  }
}

void Status::rail(uint16_t sum, uint16_t supply_mv) {
  out_.flash(kRailText);
  if (sum < kLeastRailSum || sum == frames::kSystemRailInvalid || supply_mv == 0) {
    out_.flash(kMissing);
    return;
  }
  out_.letter(' ');
  out_.number(static_cast<int32_t>(static_cast<uint32_t>(sum) * kRailDivider * supply_mv /
                                   (1024U * hal::kAnalogRounds)));
  out_.flash(kMillivolt);
}

void Status::baro(const Sensors& sensors) {
  out_.flash(kBaroText);
  if (!found(sensors, frames::kSensorsBaro)) return;
  out_.letter(' ');
  out_.number(static_cast<int32_t>(sensors.baro().static_pressure / 16U));
  out_.flash(kPascal);
}

void Status::gps(const Sensors& sensors) {
  out_.flash(kGpsText);
  if (!found(sensors, frames::kSensorsGps)) return;
  out_.flash(kFixText);
  out_.number(sensors.gps().fix);
  out_.flash(kSatellites);
  out_.number(sensors.gps().satellites);
}

void Status::receiver(const PilotLink& pilot) {
  out_.flash(kReceiverText);
  if (pilot.decoder().valid() == 0) {
    const uint16_t refused_hz = pilot.decoder().refused_hz();
    if (refused_hz == 0) {
      out_.flash(kMissing);
      return;
    }
    out_.flash(kRefused);
    out_.number(refused_hz);
    out_.flash(kHertz);
    return;
  }
  for (uint8_t channel = 0; channel < core::kChannels; ++channel) {
    out_.letter(' ');
    out_.number(pilot.channels().width_ticks[channel] / core::kTicksPerUs);
  }
}

void Status::work(const Recorder& recorder) {
  using Job = storage::Volume::Job;
  switch (recorder.job()) {
    case Job::kStart:
    case Job::kLook:
      out_.flash(kTextLooking);
      return;
    case Job::kClose:
    case Job::kMend:
      out_.flash(kTextClosing);
      return;
    case Job::kNone:
      out_.flash(kTextAwaitsGround);
      return;
    case Job::kSearch:
      out_.flash(kTextSearching);
      break;
    case Job::kMake:
      out_.flash(kTextPreparing);
      break;
  }
  out_.number(recorder.percent());
  out_.flash(kPercent);
}

void Status::card(const Recorder& recorder) {
  out_.flash(kCardText);
  switch (recorder.state()) {
    case Recorder::State::kNoFile:
      if (recorder.volume_status() != storage::VolumeStatus::kReady) {
        out_.flash(volume_text(recorder.volume_status()));
      } else {
        work(recorder);
        if (recorder.unrecorded()) out_.flash(kTextUnrecorded);
      }
      return;
    case Recorder::State::kFailed:
      out_.flash(kTextLost);
      return;
    case Recorder::State::kUndecided:
      out_.flash(kTextUndecided);
      break;
    case Recorder::State::kReady:
      out_.flash(recorder.small_file() ? kTextSmall : kTextReady);
      break;
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
