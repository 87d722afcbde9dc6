// The session: which file, when it starts and ends. Its blocks go through CardStream.
// Decisions are made in core (RecordControl, BootControl, BlockWriter), what a card needs in
// storage (Volume), in memory of the ring, which is closed then.
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
    kNoFile,     // see volume_status(): ready while the card is being worked on
    kUndecided,  // an open file was found: a reset in flight, or the battery was pulled
    kReady,
    kRecording,
    kEnding,    // the rest of the session is being written
    kFileFull,  // waits for the ground
    kFailed,    // the card went away or answers no more
  };

  Recorder(core::ByteRing& ring, Outlet& outlet, Store& store, Sensors& sensors);

  void set_file_blocks(uint32_t blocks) { volume_.set_file_blocks(blocks); }
  // Once per turn of the main loop: carries the session's block under way on.
  void step(uint32_t now_us);
  // In a turn that has done little else. Between sessions one step of what the card needs, at most
  // 1.2 ms; in one, the next of the frames that are due at its head and with each return of the
  // schema: together they would stretch the heartbeat by 2 ms.
  void work(uint32_t now_us);
  storage::Volume::Job card_job() const { return volume_.job(); }
  // The card gives the next block at once: no sleep between two turns.
  bool in_a_hurry() const;
  // Every 10 ms or so: start, stop, resume. Looks for the card at the first call.
  void decide(const core::PilotInputs& in,
              const core::Airborne& airborne,
              frames::ConfigFrame& config,
              uint32_t now_us);

  State state() const { return state_; }
  storage::VolumeStatus volume_status() const { return volume_status_; }
  // Throttle is above idle, and nothing is recorded.
  bool unrecorded() const { return unrecorded_; }
  storage::Volume::Job job() const { return volume_.job(); }
  uint8_t percent() const { return volume_.percent(); }
  // The file is ready, and smaller than one that may still be found.
  bool small_file() const { return state_ == State::kReady && volume_.smaller_than_new(); }
  uint32_t file_number() const { return volume_.file().number; }
  bool recording() const { return state_ == State::kRecording; }
  // Identity of the session, as the log and the radio get it.
  void identity(frames::IdentityFrame* out, uint32_t now_us) const;
  void put_health(frames::SystemFrame* out);

 private:
  static constexpr auto kNoStart = static_cast<frames::StartCause>(0xFF);
  static constexpr uint8_t kHeads = 6;  // the last opens the session to all other frames

  bool streams() const { return state_ == State::kRecording || state_ == State::kEnding; }
  void job_ended(storage::Volume::Job job, uint32_t now_us);
  void looked(uint32_t now_us);
  void make_room(uint32_t now_us);
  void make_file(uint32_t blocks, bool replace);
  void tell_unrecorded(bool flying, uint32_t now_us);
  void decide_open_file(const core::PilotInputs& in,
                        bool start_pressed,
                        const core::Airborne& airborne,
                        uint32_t now_us);
  void start(frames::StartCause why, uint32_t now_us);
  void begin(frames::StartCause why, bool same_session, uint32_t now_us);
  void record(core::RecordAction action, uint32_t now_us);
  void end(frames::EndCause why, uint32_t now_us);
  void tell_end();
  void finish(uint32_t now_us);
  void fail(hal::CardStatus status, uint32_t now_us);
  void tell_heads(uint32_t now_us);
  void put_head(uint8_t which, uint32_t now_us);
  void watch_room(uint32_t now_us);
  void watch_doubt(uint32_t now_us);
  static bool kept_power();
  uint32_t bytes_per_s() const;
  uint32_t least_blocks() const;
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
  uint32_t landed_us_ = 0;  // last known to be so
  uint32_t retry_us_ = 0;   // the card was last looked for, or the search began
  uint32_t marks_ = 0;
  uint32_t ended_us_ = 0;
  State state_ = State::kNoFile;
  storage::VolumeStatus volume_status_ = storage::VolumeStatus::kReady;
  bool looked_ = false;
  bool may_write_ = false;    // on the ground, and a second of throttle-up for what was begun
  bool file_wanted_ = false;  // the card is good, a new file waits for room and for the ground
  bool unrecorded_ = false;
  // A session that begins as soon as the card is free, until its event has been told.
  frames::StartCause start_why_ = kNoStart;
  bool prepared_ = false;  // the file's first block carries this power-on's session
  bool resumed_ = false;
  uint8_t heads_ = kHeads;  // put of those that are due
  bool file_low_told_ = false;
  uint32_t high_us_ = 0;      // the throttle was last not above idle
  bool landed_ = false;       // it is the ground, and nobody takes off
  bool resume_sure_ = false;  // an open file is continued because it was being recorded
  bool in_doubt_ = false;     // the session continues an open file, and nobody was seen flying yet
  frames::EndCause end_why_ = frames::EndCause::kButton;  // of the session, as its event says
  bool end_told_ = false;                                 // by its event
};

}  // namespace app
