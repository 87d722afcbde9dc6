// The session: which file, when it starts and ends, and its blocks on their way to the card.
// Decisions are made in core (RecordControl, BootControl, BlockWriter) and storage (Volume).
#pragma once

#include <stdint.h>

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
  void decide(const core::PilotInputs& in, frames::ConfigFrame& config, uint32_t now_us);

  State state() const { return state_; }
  storage::VolumeStatus volume_status() const { return volume_status_; }
  uint32_t file_number() const { return volume_.file().number; }
  bool recording() const { return state_ == State::kRecording; }
  // Identity of the session, as the log and the radio get it.
  void identity(frames::IdentityFrame* out, uint32_t now_us) const;
  void put_health(frames::SystemFrame* out);

 private:
  // Hands bytes of a block to the card.
  struct Sink {
    void put(const uint8_t* bytes, uint16_t size) { hal::put_block(bytes, size); }
  };

  void open_volume();
  void decide_open_file(const core::PilotInputs& in, bool start_pressed, uint32_t now_us);
  void begin(uint32_t why, bool same_session, uint32_t now_us);
  void record(core::RecordAction action, const core::PilotInputs& in, uint32_t now_us);
  void end(uint32_t why, uint32_t now_us);
  void tell_end();
  bool stream_ended(uint32_t now_us);
  void finish(uint32_t now_us);
  void prepare_next();
  void fail(frames::Event code, uint32_t arg, uint32_t now_us);
  void put_heads(uint32_t now_us);
  void watch_room(const core::PilotInputs& in, uint32_t now_us);
  bool landed(const core::PilotInputs& in, uint32_t now_us);
  bool room_for(uint32_t seconds, uint32_t next_block) const;
  void stream(uint32_t now_us);
  void open_stream(uint32_t now_us);
  void next_block(uint32_t now_us);
  void close_block(uint32_t now_us);
  void note_busy(uint32_t now_us);
  void tell_stall(uint32_t now_us);
  uint32_t next_session();

  core::ByteRing& ring_;
  Outlet& outlet_;
  Store& store_;
  Sensors& sensors_;
  core::BlockWriter writer_;
  storage::Volume volume_;
  core::RecordControl control_;
  core::BootControl boot_;
  const frames::ConfigFrame* config_ = nullptr;
  uint32_t retry_us_ = 0;
  uint32_t busy_from_us_ = 0;  // the card was last seen idle, opened, or given a block
  uint32_t marks_ = 0;
  uint32_t ended_us_ = 0;
  uint16_t card_errors_ = 0;
  uint16_t stall_ms_ = 0;  // not yet told by an event
  uint16_t busy_max_ms_ = 0;
  State state_ = State::kNoFile;
  storage::VolumeStatus volume_status_ = storage::VolumeStatus::kNoCard;
  uint8_t rejects_ = 0;
  bool looked_ = false;
  bool file_wanted_ = false;  // the card is good, a new file waits for the ground
  bool prepared_ = false;     // the file's first block carries this power-on's session
  bool resumed_ = false;
  bool heads_told_ = false;
  bool file_low_told_ = false;
  bool full_ = false;      // the session ended for want of room
  bool end_told_ = false;  // by its event
  bool stream_open_ = false;
  bool stream_closing_ = false;
  bool block_open_ = false;
  bool programming_ = false;
};

}  // namespace app
