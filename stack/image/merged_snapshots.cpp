// SPDX-License-Identifier: Apache-2.0
#include "stack/image/merged_snapshots.h"

#include <algorithm>

namespace linegate::image {

[[gnu::hot]] void add_marks(std::vector<PdoMark>& marks, const std::vector<PdoMark>& newer,
                            std::vector<PdoMark>& scratch) {
  if (marks.empty()) {
    marks.assign(newer.begin(), newer.end());
    return;
  }
  scratch.clear();
  auto old = marks.begin();
  for (const PdoMark& mark : newer) {
    for (; old != marks.end() && old->local_pdo < mark.local_pdo; ++old) {
      scratch.push_back(*old);
    }
    scratch.push_back(mark);
    if (old != marks.end() && old->local_pdo == mark.local_pdo) {
      scratch.back().count += (old++)->count;
    }
  }
  scratch.insert(scratch.end(), old, marks.end());
  marks.swap(scratch);
}

void LastPublished::reserve(std::size_t entries) {
  valid_.reserve((entries + 63) / 64);
  known_.reserve((entries + 63) / 64);
}

[[gnu::hot]] bool LastPublished::differs(const Snapshot& now,
                                         const std::vector<std::uint64_t>& changed) const {
  return !any_ || std::ranges::any_of(changed, [](std::uint64_t bits) { return bits != 0; }) ||
         now.valid != valid_ || now.known != known_;
}

[[gnu::hot]] void LastPublished::set(const Snapshot& snapshot) {
  any_ = true;
  valid_ = snapshot.valid;
  known_ = snapshot.known;
}

}  // namespace linegate::image
