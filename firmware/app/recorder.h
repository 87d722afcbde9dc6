// The session: which file, when it starts and ends. Its blocks go through CardStream.
// Decisions are made in core (RecordControl, BootControl, BlockWriter) and storage (Volume).
#pragma once

#include <stdint.h>

#include "app/card_stream.h"
#include "app/outlet.h"
#include "app/sensors.h"
#include "app/store.h"
#include "core/block_writer.h"
#include "core/recording.h"
#include "storage/volume.h"

namespace app {

class Recorder {
 public:
  enum class State : uint8_t {
    kNoFile,     // see volume_status()
    kUndecided,  // an open file was found: a reset in flight, or the battery was pulled
    kReady,
    kRecording,
    kEnding,    // the rest of the session is being written
    kFileFull,  // waits for the ground
    kFailed,    // the card went away or answers no more
  };

  // `memory` may be the ring's: it is used between sessions only.
  Recorder(core::ByteRing& ring,
           storage::Volume::Memory& memory,
           Outlet& outlet,
           Store& store,
           Sensors& sensors);

  void set_file_blocks(uint32_t blocks) { volume_.set_file_blocks(blocks); }
  // Once per turn of the main loop: carries the block under way on.
  void step(uint32_t now_us);
  // Every 10 ms or so: start, stop, resume. Looks for the card at the first call.
  void decide(const core::PilotInputs& in,
              const core::Airborne& airborne,
              frames::ConfigFrame& config,
              uint32_t now_us);

  State state() const { return state_; }
  storage::VolumeStatus volume_status() const { return volume_status_; }
  uint32_t file_number() const { return volume_.file().number; }
  bool recording() const { return state_ == State::kRecording; }
  // Identity of the session, as the log and the radio get it.
  void identity(frames::IdentityFrame* out, uint32_t now_us) const;
  void put_health(frames::SystemFrame* out);

 private:
  void open_volume();
  void decide_open_file(const core::PilotInputs& in,
                        bool start_pressed,
                        const core::Airborne& airborne,
                        uint32_t now_us);
  void begin(uint32_t why, bool same_session, uint32_t now_us);
  void record(core::RecordAction action, uint32_t now_us);
  void end(uint32_t why, uint32_t now_us);
  void tell_end();
  void finish(uint32_t now_us);
  void prepare_next();
  void fail(hal::CardStatus status, uint32_t now_us);
  void put_heads(uint32_t now_us);
  void watch_room(uint32_t now_us);
  void watch_doubt(uint32_t now_us);
  static bool kept_power();
  bool room_for(uint32_t seconds, uint32_t next_block) const;
  uint32_t next_session();

  core::ByteRing& ring_;
  Outlet& outlet_;
  Store& store_;
  Sensors& sensors_;
  core::BlockWriter writer_;
  CardStream stream_;
  storage::Volume volume_;
  core::RecordControl control_;
  core::BootControl boot_;
  core::FlightState flight_ = core::FlightState::kInDoubt;
  const frames::ConfigFrame* config_ = nullptr;
  uint32_t retry_us_ = 0;
  uint32_t marks_ = 0;
  uint32_t ended_us_ = 0;
  State state_ = State::kNoFile;
  storage::VolumeStatus volume_status_ = storage::VolumeStatus::kNoCard;
  bool looked_ = false;
  bool file_wanted_ = false;  // the card is good, a new file waits for the ground
  bool prepared_ = false;     // the file's first block carries this power-on's session
  bool resumed_ = false;
  bool heads_told_ = false;
  bool file_low_told_ = false;
  bool landed_ = false;       // it is the ground, and the throttle does not say take-off
  bool resume_sure_ = false;  // an open file is continued because it was being recorded
  bool in_doubt_ = false;     // the session continues an open file, and nobody was seen flying yet
  uint8_t end_why_ = 0;       // of the session, as its event says
  bool end_told_ = false;     // by its event
};

}  // namespace app
