// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/image_sequence.h"

#include <algorithm>

namespace linegate::gateway {
void merge_marks(std::vector<image::PdoMark>& marks, const std::vector<image::PdoMark>& newer) {
  for (const image::PdoMark& mark : newer) {
    const auto it = std::find_if(marks.begin(), marks.end(), [&](const image::PdoMark& other) {
      return other.local_pdo == mark.local_pdo;
    });
    if (it == marks.end()) {
      marks.push_back(mark);
    } else {
      const std::uint32_t before = it->count;
      *it = mark;
      it->count += before;
    }
  }
}

bool ImageSequence::changed(const image::Snapshot& snapshot) const {
  return number_ == 0 || snapshot.valid != last_valid_ || snapshot.known != last_known_ ||
         std::any_of(snapshot.changed.begin(), snapshot.changed.end(),
                     [](std::uint64_t bits) { return bits != 0; });
}

bool ImageSequence::admit(image::Snapshot& snapshot) {
  if (rule_ == config::Publish::Rule::on_change && !changed(snapshot)) {
    merge_marks(skipped_, snapshot.marks);
    return false;
  }
  if (!skipped_.empty()) {
    merge_marks(skipped_, snapshot.marks);
    snapshot.marks.swap(skipped_);
    skipped_.clear();
  }
  last_valid_ = snapshot.valid;
  last_known_ = snapshot.known;
  snapshot.sequence = ++number_;
  return true;
}

}  // namespace linegate::gateway
