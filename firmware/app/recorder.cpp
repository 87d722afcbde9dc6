#include "app/recorder.h"

#include <string.h>

#include "app/version.h"
#include "hal/clock.h"
#include "hal/system.h"
#include "storage/block_build.h"

namespace app {

using frames::EndCause;
using frames::StartCause;
using hal::CardStatus;
using storage::VolumeStatus;
using Job = storage::Volume::Job;

namespace {

constexpr uint32_t kRetryUs = 2000000UL;
constexpr uint32_t kSearchUs = 5000000UL;  // then a file of kSmallSeconds is enough, for now
constexpr uint32_t kSmallSeconds = 900;
constexpr uint32_t kHurryUs = 30000000UL;  // since power-on: a pilot waits for the file
constexpr uint32_t kGraceUs = 1000000UL;
constexpr uint32_t kLowSeconds = 60;
constexpr uint32_t kLeastSeconds = 1800;    // with less left, the ground prepares a new file
constexpr uint32_t kOtherBytesPerS = 1000;  // frames beside the identification frame

constexpr uint32_t kTakeOffUs = 18000000UL;  // as core::Airborne::kAloneS

// The events of the end and the frame `file`, and what only events may use.
constexpr uint16_t kLastWords = 2 * frames::kEventWireSize + frames::kFileWireSize + 48;

// Blocks the end of a session may need: the ring, and a return of the schema under way.
constexpr uint32_t kEndBlocks = 32;

// `from` lies in program memory.
void copy_text(char* to, const char* from, uint8_t size) {
  memset(to, 0, size);
  for (uint8_t i = 0; i + 1 < size; ++i) {
    to[i] = static_cast<char>(core::flash_u8(from + i));
    if (to[i] == '\0') return;
  }
}

}  // namespace

Recorder::Recorder(core::ByteRing& ring, Outlet& outlet, Store& store, Sensors& sensors)
    : ring_(ring),
      outlet_(outlet),
      store_(store),
      sensors_(sensors),
      writer_(ring, storage::schema_text(), storage::schema_size(), storage::schema_hash()),
      stream_(writer_, outlet) {
  ring_.close();
}

void Recorder::step(uint32_t now_us) {
  if (!streams()) return;
  const CardStatus status = stream_.step(now_us);
  if (status != CardStatus::kOk) fail(status, now_us);
}

bool Recorder::in_a_hurry() const {
  return volume_.job() != Job::kNone && !volume_.waits();
}

void Recorder::work(uint32_t now_us) {
  if (state_ == State::kRecording) tell_heads(now_us);
  if (streams()) return;
  const Job job = volume_.job();
  uint8_t* const sector = ring_.lend();
  if (job == Job::kNone || sector == nullptr) return;
  if (volume_.step(sector, may_write_)) job_ended(job, now_us);
}

void Recorder::decide(const core::PilotInputs& in,
                      const core::Airborne& airborne,
                      frames::ConfigFrame& config,
                      uint32_t now_us) {
  config_ = &config;
  const bool high = in.throttle_valid && !in.throttle_idle;
  flight_ = airborne.state();
  // A throttle above idle may be the take-off, unless nothing else moves for so long.
  if (!high) high_us_ = now_us;
  const bool takes_off = high && now_us - high_us_ < kTakeOffUs;
  landed_ = flight_ == core::FlightState::kGround && !takes_off;
  if (landed_) landed_us_ = now_us;
  may_write_ = landed_ || (may_write_ && flight_ == core::FlightState::kGround &&
                           now_us - landed_us_ < kGraceUs);
  const core::RecordAction action =
      control_.update(in, recording(), config.auto_start != 0, now_us);
  const uint16_t press_ms = control_.take_press_ms();
  if (press_ms > 0) outlet_.event(frames::Event::kButton, press_ms, now_us);
  const bool start_button = action == core::RecordAction::kStartButton;
  tell_unrecorded(high, now_us);
  switch (state_) {
    case State::kNoFile:
    case State::kFailed:
      if (file_wanted_) {
        make_room(now_us);
      } else if (volume_.job() == Job::kNone && (!looked_ || now_us - retry_us_ >= kRetryUs)) {
        looked_ = true;
        start_why_ = kNoStart;
        volume_.look();
      }
      break;
    case State::kUndecided:
      decide_open_file(in, start_button, airborne, now_us);
      break;
    case State::kReady:
      if (start_button) start_why_ = StartCause::kButton;
      if (action == core::RecordAction::kStartThrottle) start_why_ = StartCause::kThrottle;
      if (start_why_ != kNoStart) {
        start(start_why_, now_us);
      } else {
        make_room(now_us);
      }
      break;
    case State::kRecording:
      record(action, now_us);
      break;
    case State::kEnding:
      if (!end_told_) {
        tell_end();
      } else if (writer_.drained() && stream_.rests() && stream_.ended(now_us)) {
        if (end_why_ == EndCause::kFileFull) {
          state_ = State::kFileFull;
        } else if (landed_) {
          finish(now_us);
        }
      }
      break;
    case State::kFileFull:
      if (landed_) finish(now_us);
      break;
  }
}

// A reset that is no loss of power, with the mark of a recording: it goes on, wherever we are.
bool Recorder::kept_power() {
  const hal::ResetSource source = hal::reset_source();
  return source != hal::ResetSource::kPowerOn && source != hal::ResetSource::kBrownOut;
}

void Recorder::tell_unrecorded(bool flying, uint32_t now_us) {
  const bool cannot =
      state_ == State::kNoFile || state_ == State::kFailed || state_ == State::kFileFull;
  const bool before = unrecorded_;
  unrecorded_ = cannot && flying && config_->auto_start != 0;
  if (unrecorded_ && !before) outlet_.event(frames::Event::kUnrecorded, 0, now_us);
}

void Recorder::job_ended(Job job, uint32_t now_us) {
  retry_us_ = now_us;
  const VolumeStatus status = volume_.status();
  if (status != VolumeStatus::kReady) {
    if (state_ != State::kReady || job != Job::kSearch) {
      volume_status_ = status;
      if (state_ != State::kFailed) state_ = State::kNoFile;
    }
    file_wanted_ = false;
    return;
  }
  switch (job) {
    case Job::kLook:
      looked(now_us);
      break;
    case Job::kSearch:
      if (state_ == State::kReady || volume_.best_blocks() >= least_blocks()) break;
      file_wanted_ = false;
      volume_status_ = volume_.shortage(least_blocks());
      break;
    case Job::kMake:
      state_ = State::kReady;
      volume_status_ = status;
      file_wanted_ = volume_.smaller_than_new();
      if (file_wanted_) volume_.go_on_searching();
      break;
    case Job::kMend:
      outlet_.event(frames::Event::kFileMended, volume_.file().number, now_us);
      break;
    case Job::kClose:
      state_ = State::kNoFile;
      volume_.look_again();
      break;
    case Job::kNone:
    case Job::kStart:
      break;
  }
}

void Recorder::looked(uint32_t now_us) {
  const bool after_failure = state_ == State::kFailed;
  const uint32_t odd = static_cast<uint32_t>(volume_.odd());
  if (odd != 0) {
    outlet_.event(frames::Event::kFileOdd, odd << 24 | volume_.file().number, now_us);
  }
  prepared_ = false;
  switch (volume_.state()) {
    case storage::FileState::kNone:
    case storage::FileState::kClosed:
      // The card answers. That it is full stays said until room is found.
      if (volume_status_ != VolumeStatus::kFull && volume_status_ != VolumeStatus::kFragmented) {
        volume_status_ = VolumeStatus::kReady;
      }
      state_ = State::kNoFile;
      file_wanted_ = true;
      break;
    case storage::FileState::kBlank:
      volume_status_ = VolumeStatus::kReady;
      state_ = State::kReady;
      file_wanted_ = volume_.smaller_than_new();
      break;
    case storage::FileState::kOpen:
      volume_status_ = VolumeStatus::kReady;
      boot_.start(hal::flight_mark() || after_failure);
      resume_sure_ = after_failure || (hal::flight_mark() && kept_power());
      state_ = State::kUndecided;
      return;
  }
  if (file_wanted_) volume_.search();
}

// Room for a new file, or for more of one that is ready and small: taken when it is as large as it
// can be, or after a while when it is large enough.
void Recorder::make_room(uint32_t now_us) {
  const Job job = volume_.job();
  if (!file_wanted_ || !landed_ || (job != Job::kNone && job != Job::kSearch)) return;
  const bool replace = state_ == State::kReady;
  const uint32_t best = volume_.best_blocks();
  const uint32_t now_blocks = volume_.file().blocks;
  const uint32_t least = replace ? now_blocks + now_blocks / 4 + 1 : least_blocks();
  const bool most = job == Job::kNone;
  const bool small = !replace || now_blocks < least_blocks();
  const bool enough =
      small && now_us - retry_us_ >= kSearchUs && best >= least_blocks() && !volume_.best_grows();
  if (most && best < least) file_wanted_ = false;
  if (best < least || !(most || enough) || !volume_.leave()) return;
  volume_.set_date(sensors_.fat_date());
  if (volume_.can_mend()) {
    volume_.mend();
  } else {
    // A long chain is linked when a file is ready already. (Not later: the small file takes its
    // room out of what may be the only run.)
    const bool small_first = !replace && now_us < kHurryUs && volume_.slow_to_make(best);
    make_file(small_first ? least : volume_.file_blocks(), replace);
  }
}

void Recorder::make_file(uint32_t blocks, bool replace) {
  const uint32_t session = replace && prepared_ ? volume_.file().last_session : next_session();
  prepared_ = true;
  volume_.make(session, blocks, replace);
  if (volume_.job() == Job::kNone) job_ended(Job::kMake, hal::now_us());
}

void Recorder::decide_open_file(const core::PilotInputs& in,
                                bool start_pressed,
                                const core::Airborne& airborne,
                                uint32_t now_us) {
  if (volume_.job() != Job::kNone) return;  // it is being closed
  switch (boot_.update(in, start_pressed, flight_, airborne.moves(), now_us)) {
    case core::BootAction::kWait:
      return;
    case core::BootAction::kResume:
      begin(StartCause::kResumed, false, now_us);
      in_doubt_ = !start_pressed && !resume_sure_;
      return;
    case core::BootAction::kClose:
      volume_.set_date(sensors_.fat_date());
      volume_.close(volume_.file().next_block, !volume_.file().ended, now_us);
      return;
  }
}

// A search is left at once; a block under way on the card comes to its end first.
void Recorder::start(StartCause why, uint32_t now_us) {
  if (!volume_.leave()) return;
  begin(why, prepared_, now_us);
}

uint32_t Recorder::next_session() {
  const uint32_t in_file = volume_.file().last_session;
  const uint32_t largest = in_file > store_.session() ? in_file : store_.session();
  store_.set_session(largest + 1);
  return largest + 1;
}

void Recorder::begin(StartCause why, bool same_session, uint32_t now_us) {
  const storage::FlightFile& file = volume_.file();
  const uint32_t session = same_session ? file.last_session : next_session();
  prepared_ = false;
  resumed_ = why == StartCause::kResumed;
  writer_.start(file.file_id, session, file.next_block, now_us);
  start_why_ = why;
  heads_ = kHeads;
  in_doubt_ = false;
  file_low_told_ = false;
  marks_ = 0;
  stream_.start(file.first_lba);
  state_ = State::kRecording;
  hal::set_flight_mark(true);
}

// One per turn. Other frames follow the first heads of a session, as protocol/README.md says.
void Recorder::tell_heads(uint32_t now_us) {
  if (writer_.take_identities_due()) heads_ = 0;
  if (heads_ == kHeads) return;
  put_head(heads_, now_us);
  ++heads_;
}

// Apart, so that its frames stand on the stack for as long as they are made.
__attribute__((noinline)) void Recorder::put_head(uint8_t which, uint32_t now_us) {
  switch (which) {
    case 0: {
      frames::ConfigFrame config = *config_;
      config.t_us = now_us;
      outlet_.put_head(config);
      return;
    }
    case 1: {
      frames::IdentityFrame who;
      identity(&who, now_us);
      outlet_.put_head(who);
      return;
    }
    case 2: {
      const storage::FlightFile& file = volume_.file();
      outlet_.put_head(frames::FileFrame{now_us, file.number, file.blocks * hal::kCardBlockBytes});
      return;
    }
    case 3:
      outlet_.put_head(frames::ImageFrame{now_us, hal::image_hash()});
      return;
    case 4: {
      frames::BaroCoefficientsFrame words;
      if (sensors_.coefficients(&words, now_us)) outlet_.put_head(words);
      return;
    }
    default:
      if (start_why_ == kNoStart) return;
      outlet_.open();
      outlet_.event(frames::Event::kSessionStart, static_cast<uint32_t>(start_why_), now_us);
      outlet_.release_waiting();
      start_why_ = kNoStart;
      return;
  }
}

void Recorder::identity(frames::IdentityFrame* out, uint32_t now_us) const {
  memset(out, 0, sizeof *out);
  out->t_us = now_us;
  out->session = writer_.session();
  (void)hal::read_card_id(out->card_id);  // zeros without a card
  out->boots = store_.boots();
  out->reset_cause = static_cast<uint8_t>(hal::reset_source());
  out->resumed = resumed_ ? 1 : 0;
  copy_text(out->board, hal::board_name(), sizeof out->board);
  static_assert(sizeof kVersion <= sizeof out->firmware, "the version fits its field");
  core::flash_copy(out->firmware, kVersion, sizeof kVersion);
}

void Recorder::record(core::RecordAction action, uint32_t now_us) {
  if (start_why_ != kNoStart) return;  // its heads are under way
  if (action == core::RecordAction::kMark) outlet_.event(frames::Event::kMark, ++marks_, now_us);
  watch_room(now_us);
  watch_doubt(now_us);
  if (action == core::RecordAction::kStop) end(EndCause::kButton, now_us);
}

uint32_t Recorder::bytes_per_s() const {
  return static_cast<uint32_t>(config_->rate_hz) * frames::kIdentWireSize + kOtherBytesPerS;
}

uint32_t Recorder::least_blocks() const {
  const uint32_t blocks = bytes_per_s() * kSmallSeconds / core::kBlockPayloadSize + kEndBlocks;
  return blocks < volume_.file_blocks() ? blocks : volume_.file_blocks();
}

// Compared in bytes: a division costs 640 cycles, every turn of the loop.
bool Recorder::room_for(uint32_t seconds, uint32_t next_block) const {
  const uint32_t needed = next_block + kEndBlocks;
  const uint32_t blocks = volume_.file().blocks;
  return blocks > needed && (blocks - needed) * core::kBlockPayloadSize > bytes_per_s() * seconds;
}

// A file was continued because this might have been a flight, and it was none.
void Recorder::watch_doubt(uint32_t now_us) {
  if (flight_ == core::FlightState::kFlying) in_doubt_ = false;
  if (in_doubt_ && landed_) end(EndCause::kNoFlight, now_us);
}

void Recorder::watch_room(uint32_t now_us) {
  const uint32_t next = writer_.sequence();
  if (next + kEndBlocks >= volume_.file().blocks) {
    end(EndCause::kFileFull, now_us);
    return;
  }
  // The next flight gets a new file rather than the end of this one. (A file that never had so much
  // room is used to its half at least.)
  if (!room_for(kLeastSeconds, next) && next > volume_.file().blocks / 2 && landed_) {
    end(EndCause::kFileFull, now_us);
    return;
  }
  if (file_low_told_ || room_for(kLowSeconds, next)) return;
  file_low_told_ = true;
  outlet_.event(frames::Event::kFileLow, kLowSeconds, now_us);
}

void Recorder::end(EndCause why, uint32_t now_us) {
  if (state_ != State::kRecording) return;
  outlet_.close();
  hal::set_flight_mark(false);
  state_ = State::kEnding;
  ended_us_ = now_us;
  end_why_ = why;
  end_told_ = false;
  (void)outlet_.send(frames::Event::kSessionEnd, static_cast<uint32_t>(why), now_us);
  tell_end();
}

// The ring may be full: then the last words wait until the card has taken a block of it.
void Recorder::tell_end() {
  if (ring_.free() < kLastWords) return;
  (void)ring_.tell_dropped();
  const storage::FlightFile& file = volume_.file();
  // The next boot may have to free what is behind the end: it asks the last block how far.
  (void)ring_.push(frames::FileFrame{ended_us_, file.number, file.blocks * hal::kCardBlockBytes});
  (void)ring_.push_event(frames::Event::kSessionEnd, static_cast<uint32_t>(end_why_), ended_us_);
  writer_.finish();
  end_told_ = true;
}

void Recorder::finish(uint32_t now_us) {
  ring_.close();
  volume_.set_date(sensors_.fat_date());
  volume_.close(writer_.sequence(), false, now_us);
  volume_status_ = VolumeStatus::kReady;
  file_wanted_ = false;
  state_ = State::kNoFile;
}

void Recorder::fail(CardStatus status, uint32_t now_us) {
  outlet_.close();
  ring_.close();
  file_wanted_ = false;
  if (status == CardStatus::kAbsent) {
    outlet_.event(frames::Event::kCardRemoved, 0, now_us);
  } else {
    outlet_.event(frames::Event::kCardError, static_cast<uint32_t>(status), now_us);
  }
  state_ = State::kFailed;
  volume_status_ = VolumeStatus::kNoCard;
  retry_us_ = now_us;
}

void Recorder::put_health(frames::SystemFrame* out) {
  out->frames_dropped = ring_.dropped();
  out->blocks_written = writer_.blocks_written();
  out->ring_free_min = ring_.take_free_min();
  stream_.put_health(out);
  const bool card = state_ != State::kNoFile && state_ != State::kFailed;
  if (card) out->sensors = static_cast<uint8_t>(out->sensors | frames::kSensorsCard);
}

}  // namespace app
