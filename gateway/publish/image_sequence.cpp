// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/image_sequence.h"

namespace linegate::gateway {

bool ImageSequence::admit(image::Snapshot& snapshot) {
  if (rule_ == config::Publish::Rule::on_change &&
      !published_.differs(snapshot, snapshot.changed)) {
    image::add_marks(skipped_, snapshot.marks, scratch_);
    return false;
  }
  if (!skipped_.empty()) {
    image::add_marks(skipped_, snapshot.marks, scratch_);
    snapshot.marks.swap(skipped_);
    skipped_.clear();
  }
  published_.set(snapshot);
  snapshot.sequence = ++number_;
  return true;
}

}  // namespace linegate::gateway
