#include "storage/free_run.h"

#include "storage/fat_sector.h"

namespace storage {

void FreeRun::start(const Layout& layout, uint32_t from, uint32_t count, uint32_t wanted) {
  *this = FreeRun();
  at_ = layout.has_cluster(from) ? from : kFirstCluster;
  now_.first = at_;
  left_ = count < layout.clusters ? count : layout.clusters;
  total_ = left_;
  wanted_ = wanted;
}

void FreeRun::go_on_from(const Layout& layout, uint32_t from) {
  const Run found = best_;
  start(layout, from, layout.clusters, wanted_);
  best_ = found;
}

bool FreeRun::take(const uint8_t* sector, const Layout& layout) {
  uint16_t index = entry_index(layout, at_);
  uint16_t count = static_cast<uint16_t>((1U << entries_shift(layout)) - index);
  const uint32_t to_end = layout.clusters + kFirstCluster - at_;
  if (count > to_end) count = static_cast<uint16_t>(to_end);
  if (count > left_) count = static_cast<uint16_t>(left_);
  left_ -= count;
  uint16_t run = 0;  // at the end of what is looked at, in this sector
  uint16_t free_here = 0;
  for (; count != 0; --count, ++index) {
    if (entry(sector, layout, index) == kFreeEntry) {
      ++run;
      ++free_here;
      ++at_;
      continue;
    }
    now_.count += run;
    if (now_.count > best_.count) best_ = now_;
    run = 0;
    ++at_;
    now_ = {at_, 0};
  }
  free_ += free_here;
  now_.count += run;
  if (now_.count > best_.count) best_ = now_;
  if (best_.count > wanted_) best_.count = wanted_;
  if (at_ - kFirstCluster == layout.clusters) {  // goes on at the other end, which is another run
    at_ = kFirstCluster;
    now_ = {at_, 0};
  }
  return ended();
}

Run FreeRun::take_best(uint32_t most) {
  const Run taken = {best_.first, best_.count < most ? best_.count : most};
  if (now_.first == best_.first &&
      now_.count >= taken.count) {  // it may go on behind what was looked at
    now_.first += taken.count;
    now_.count -= taken.count;
  } else if (now_.first < taken.first + taken.count && taken.first < at_) {
    now_ = {at_, 0};  // the same clusters, found a second time
  }
  best_.first += taken.count;
  best_.count -= taken.count;
  return taken;
}

}  // namespace storage
