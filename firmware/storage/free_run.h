// Looks for a run of free clusters, sector by sector, once round the volume. The longest found so
// far may be taken at any time; the search then goes on where it stands.
#pragma once

#include <stdint.h>

#include "storage/boot_sector.h"

namespace storage {

struct Run {
  uint32_t first;
  uint32_t count;  // 0: none
};

class FreeRun {
 public:
  // Looks at `count` clusters from `from` on, for a run of `wanted`.
  void start(const Layout& layout, uint32_t from, uint32_t count, uint32_t wanted);
  // All of the layout, from another cluster on; what was found stays found.
  void go_on_from(const Layout& layout, uint32_t from);
  uint32_t cluster() const { return at_; }  // the sector that holds its entry is looked at next
  // True: a run of `wanted` is found, or all is looked at.
  bool take(const uint8_t* sector, const Layout& layout);
  bool ended() const { return left_ == 0 || best_.count >= wanted_; }

  const Run& best() const { return best_; }
  // The search is within it: it may be larger than what was looked at.
  bool best_grows() const { return best_.count != 0 && now_.first == best_.first && !ended(); }
  // Gives the first `most` clusters of the best run away; the rest of it is a run still.
  Run take_best(uint32_t most);
  uint32_t free_clusters() const { return free_; }
  uint32_t looked_at() const { return total_ - left_; }
  uint32_t total() const { return total_; }

 private:
  Run best_ = {};
  Run now_ = {};
  uint32_t at_ = 0;
  uint32_t left_ = 0;
  uint32_t total_ = 0;
  uint32_t wanted_ = 0;
  uint32_t free_ = 0;
};

}  // namespace storage
