// The card's file system: finds, prepares and closes flight files FLTnnnnn.BIN. One job at a time,
// in steps that return to the main loop: each moves or looks at one block and lasts at most 1.2 ms.
#pragma once

#include <stdint.h>

#include "hal/block_device.h"
#include "storage/card_state.h"
#include "storage/close_file.h"
#include "storage/free_run.h"
#include "storage/look.h"
#include "storage/make_file.h"
#include "storage/transfer.h"

namespace storage {

class Volume {
 public:
  enum class Job : uint8_t { kNone, kStart, kLook, kSearch, kMake, kClose, kMend };

  static constexpr uint32_t kFileBlocks = Look::kMostBlocks;  // 64 MiB: 2.6 h at 100 Hz
  static constexpr uint32_t kMaxNumber = 99999;

  // Tests use smaller files. At least 2 blocks.
  void set_file_blocks(uint32_t blocks) { file_blocks_ = blocks; }
  // Date of new and closed files, as core::fat_time() makes it; 0: not known.
  void set_date(uint32_t fat_time) { card_.date = fat_time; }

  // --- jobs; `step` until it says that the job has ended, then ask `status` ---
  void look();        // starts the card, then as look_again()
  void look_again();  // what is on it: file(), state(), odd()
  // Looks for room; best_blocks() grows. It may be left for another job at any time, and gone on
  // with. Ends with room for a whole file, or with all of the card looked at.
  void search();
  void go_on_searching() { begin(Job::kSearch, more_of_run()); }
  // A file of at most `blocks` in the best room found; what is left of it is room still. The next
  // number, with a first block of its own, so that its id
  // is known and no older block behind it can be taken for its content; or, with `replace`, the
  // same file with more room: only one that was never recorded into. Where the room is behind it
  // it stays where it is.
  void make(uint32_t session, uint32_t blocks, bool replace);
  // Its chain is so long that linking it takes more than a second.
  bool slow_to_make(uint32_t blocks) const;
  // Cuts file() to `used_blocks`. With `end_event` a block saying session_end goes behind them.
  void close(uint32_t used_blocks, bool end_event, uint32_t now_us);
  bool can_mend() const { return CloseFile::can_mend(card_); }
  void mend();

  // Goes on with the job, in memory of kSectorBytes that stays as it is between the steps of a job.
  // Writes are begun only while `may_write`. True: the job has ended.
  bool step(uint8_t* sector, bool may_write);
  // Leaves the job if the card is not in the middle of a block; false: ask again.
  bool leave();

  Job job() const { return job_; }
  bool waits() const { return waits_; }  // with a write, for the ground
  uint8_t percent() const;               // of the job
  VolumeStatus status() const { return status_; }
  FileState state() const { return card_.state; }
  frames::FileState odd() const { return card_.odd; }
  const FlightFile& file() const { return card_.file; }
  bool smaller_than_new() const { return card_.file.blocks < file_blocks_; }
  uint32_t file_blocks() const { return file_blocks_; }
  // Of a file in the room found so far; behind a file that may be given more, of both together.
  uint32_t best_blocks() const;
  bool best_grows() const { return run_.best_grows(); }
  // Why there is no room for `blocks`, behind a search of the whole card.
  VolumeStatus shortage(uint32_t blocks) const;

 private:
  void begin(Job job, Wish first);
  void follow(Wish wish);
  Wish next(uint8_t* sector);
  Wish next_run(uint8_t* sector);
  Wish read_run() const;
  Wish more_of_run();
  bool may_grow() const;
  uint32_t found_clusters() const;
  uint32_t behind_last() const;  // the cluster behind the newest file; 0: there is none
  uint32_t clusters_for_new(uint32_t blocks) const;
  void end(VolumeStatus status);

  CardState card_;
  FreeRun run_;
  Transfer transfer_;
  union {  // one job at a time
    Look look_ = {};
    MakeFile make_;
    CloseFile close_;
  };
  uint32_t file_blocks_ = kFileBlocks;
  Job job_ = Job::kNone;
  VolumeStatus status_ = VolumeStatus::kNoCard;
  Wish::Kind wish_ = Wish::Kind::kAgain;
  bool waits_ = false;
  uint8_t paused_ = 0;  // turns that a search rests at its end of a block, so that it can be left
  bool near_ = false;   // the search is still where FSInfo points
};

}  // namespace storage
