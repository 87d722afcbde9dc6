#include "storage/volume.h"

#include "storage/fat_sector.h"

namespace storage {

using hal::CardStatus;

namespace {

// 64 MiB in clusters of 16 kB. Linking takes 0.2 ms a cluster on the simulated chip, the second
// copy of the table included.
constexpr uint32_t kQuickClusters = 4096;

// Turns of the main loop, 1 ms each: leave() is asked again within 10.
constexpr uint8_t kPauseTurns = 30;

}  // namespace

void Volume::look() {
  hal::start_card();
  card_.file = FlightFile();
  job_ = Job::kStart;
}

void Volume::look_again() {
  begin(Job::kLook, look_.start(card_));
}

void Volume::make(uint32_t session, uint32_t blocks, bool replace) {
  const bool grow = replace && may_grow();
  const uint32_t has = grow ? card_.layout.clusters_for(card_.file.blocks) : 0;
  const Run run = run_.take_best(clusters_for_new(blocks) - has);
  // FAT32's root folder can be made longer by a cluster.
  const bool place = replace || card_.free_entry.lba != 0 || (card_.layout.wide && run.count > 1);
  if (run.count == 0 || !place || (!replace && card_.file.number >= kMaxNumber)) {
    job_ = Job::kNone;
    status_ = VolumeStatus::kFull;
    return;
  }
  const uint32_t room = (has + run.count) << card_.layout.cluster_shift;
  if (blocks > room) blocks = room;
  const MakeFile::Kind kind = grow      ? MakeFile::Kind::kGrow
                              : replace ? MakeFile::Kind::kReplace
                                        : MakeFile::Kind::kNew;
  begin(Job::kMake, make_.start(run, blocks, session, kind, card_));
}

void Volume::close(uint32_t used_blocks, bool end_event, uint32_t now_us) {
  begin(Job::kClose, close_.start(used_blocks, end_event, now_us, card_));
}

void Volume::mend() {
  begin(Job::kMend, close_.mend(card_));
}

// Behind the last file there is most likely room, and where FSInfo points: a PC may have deleted
// files since.
void Volume::search() {
  const Layout& layout = card_.layout;
  const uint32_t wanted = clusters_for_new(file_blocks_);
  near_ = layout.has_cluster(card_.next_cluster);
  if (near_) {
    run_.start(layout, card_.next_cluster, 2 * wanted, wanted);
  } else {
    run_.start(layout, behind_last(), layout.clusters, wanted);
  }
  job_ = Job::kSearch;
  follow(read_run());
}

// Of a file, and one for a root folder that is full; a blank file has its entry.
uint32_t Volume::clusters_for_new(uint32_t blocks) const {
  const bool has_entry = card_.free_entry.lba != 0 || card_.state == FileState::kBlank;
  const bool folder_full = card_.layout.wide && !has_entry;
  return card_.layout.clusters_for(blocks) + (folder_full ? 1 : 0);
}

Wish Volume::read_run() const {
  return read_block(entry_lba(card_.layout, run_.cluster()));
}

Wish Volume::next_run(uint8_t* sector) {
  const Layout& layout = card_.layout;
  const uint32_t folder = card_.folder_end;
  // Where the root folder stands nothing is free, whatever a damaged table says.
  if (folder != 0 && entry_lba(layout, folder) == entry_lba(layout, run_.cluster())) {
    put_entry(sector, layout, entry_index(layout, folder), kEndEntry);
  }
  run_.take(sector, layout);
  return more_of_run();
}

Wish Volume::more_of_run() {
  if (found_clusters() >= clusters_for_new(file_blocks_)) return done();
  if (!run_.ended()) return read_run();
  if (!near_) return done();
  near_ = false;
  run_.go_on_from(card_.layout, behind_last());
  return read_run();
}

uint32_t Volume::behind_last() const {
  const FlightFile& file = card_.file;
  if (file.first_lba == 0) return 0;
  return card_.first_cluster() + card_.layout.clusters_for(file.blocks);
}

void Volume::begin(Job job, Wish first) {
  job_ = job;
  follow(first);
}

void Volume::follow(Wish wish) {
  wish_ = wish.kind;
  switch (wish.kind) {
    case Wish::Kind::kRead:
      transfer_.read(wish.lba);
      break;
    case Wish::Kind::kWrite:
      transfer_.write(wish.lba);
      break;
    case Wish::Kind::kAgain:
      break;
    case Wish::Kind::kDone:
      end(job_ == Job::kLook ? look_.status() : VolumeStatus::kReady);
      break;
    case Wish::Kind::kFailed:
      end(VolumeStatus::kUnreadable);
      break;
  }
}

void Volume::end(VolumeStatus status) {
  status_ = status;
  job_ = Job::kNone;
}

bool Volume::step(uint8_t* sector, bool may_write) {
  if (job_ == Job::kNone) return true;
  waits_ = false;
  CardStatus status = CardStatus::kOk;
  if (job_ == Job::kStart) {
    status = hal::poll_start();
    if (status == CardStatus::kOk) {
      look_again();
      return false;
    }
  } else if (wish_ == Wish::Kind::kRead || wish_ == Wish::Kind::kWrite) {
    status = transfer_.step(sector, may_write);
    if (status == CardStatus::kOk) {  // what it says is looked at in the next turn
      wish_ = Wish::Kind::kAgain;
      return false;
    }
  } else {
    if (job_ == Job::kSearch && paused_ != 0) {
      --paused_;
      return false;
    }
    follow(next(sector));
    if (job_ != Job::kSearch) return job_ == Job::kNone;
    status = transfer_.step(sector, may_write);  // its sectors are quickly looked at
  }
  if (status == CardStatus::kBusy) {
    waits_ = job_ == Job::kStart || !transfer_.under_way();
    return false;
  }
  end(status == CardStatus::kAbsent ? VolumeStatus::kNoCard : VolumeStatus::kUnreadable);
  return true;
}

Wish Volume::next(uint8_t* sector) {
  switch (job_) {
    case Job::kLook:
      return look_.next(sector, card_);
    case Job::kSearch:
      return next_run(sector);
    case Job::kMake:
      return make_.next(sector, card_);
    case Job::kClose:
    case Job::kMend:
      return close_.next(sector, card_);
    case Job::kNone:
    case Job::kStart:
      break;
  }
  return failed();
}

bool Volume::leave() {
  if (job_ == Job::kNone) return true;
  // Nearly always a block is under way: without the pause the asking and the blocks may keep step.
  paused_ = kPauseTurns;
  if (job_ == Job::kStart || transfer_.under_way()) return false;
  // Not behind a block of another job that nobody has looked at: the card may hold more than is
  // known here. A search reads its sector again.
  if (job_ != Job::kSearch && wish_ == Wish::Kind::kAgain) return false;
  job_ = Job::kNone;
  paused_ = 0;
  return true;
}

bool Volume::slow_to_make(uint32_t blocks) const {
  return card_.layout.clusters_for(blocks) > kQuickClusters;
}

// The rest of the run that a small file was made of, or clusters that became free behind it.
bool Volume::may_grow() const {
  return card_.state == FileState::kBlank && run_.best().first == behind_last();
}

uint32_t Volume::found_clusters() const {
  return run_.best().count + (may_grow() ? card_.layout.clusters_for(card_.file.blocks) : 0);
}

uint32_t Volume::best_blocks() const {
  const uint32_t room = found_clusters() << card_.layout.cluster_shift;
  return room < file_blocks_ ? room : file_blocks_;
}

uint8_t Volume::percent() const {
  if (job_ == Job::kMake) return make_.percent();
  if (job_ != Job::kSearch || near_) return 0;
  return static_cast<uint8_t>(run_.looked_at() / (run_.total() / 100 + 1));
}

VolumeStatus Volume::shortage(uint32_t blocks) const {
  return run_.free_clusters() >= card_.layout.clusters_for(blocks) ? VolumeStatus::kFragmented
                                                                   : VolumeStatus::kFull;
}

}  // namespace storage
