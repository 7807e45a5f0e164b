// SPDX-License-Identifier: Apache-2.0
// Combines successive snapshots of one direction: the sum of their receptions, and whether one
// differs from the last published one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stack/image/snapshot.h"

namespace linegate::image {

// Adds the receptions of a later snapshot to `marks`: the counts add up, and the times are the
// newer ones. Both are in the order of local_pdo, as those of each snapshot. Allocates nothing if
// `marks` and `scratch`, whose content is lost, have room.
void add_marks(std::vector<PdoMark>& marks, const std::vector<PdoMark>& newer,
               std::vector<PdoMark>& scratch);

// The validity of all entries in the last published snapshot.
class LastPublished {
 public:
  // So that set() does not allocate with up to that many entries.
  void reserve(std::size_t entries);
  // Whether the snapshot differs in more than receptions. changed: the entries that
  // changed since the last one, a bit for each, as in Snapshot.
  bool differs(const Snapshot& now, const std::vector<std::uint64_t>& changed) const;
  // The snapshot was published.
  void set(const Snapshot& snapshot);

 private:
  bool any_ = false;
  std::vector<std::uint64_t> valid_;
  std::vector<std::uint64_t> known_;
};

}  // namespace linegate::image
