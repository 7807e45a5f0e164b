// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/deferred_image.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "stack/image/merged_snapshots.h"

namespace linegate::gateway {

void DeferredImage::defer(image::Snapshot& snapshot, Instant now) {
  add_earlier(snapshot);
  newest_ = &snapshot;
  layout_id_ = snapshot.layout_id;
  changed_ = snapshot.changed;
  marks_ = snapshot.marks;
  due_ = now + kPeriod;
}

image::Snapshot* DeferredImage::take(image::Snapshot* fetched) {
  image::Snapshot* const out = fetched != nullptr ? fetched : newest_;
  if (fetched != nullptr) {
    add_earlier(*fetched);
  }
  newest_ = nullptr;
  layout_id_ = 0;
  return out;
}

void DeferredImage::add_earlier(image::Snapshot& to) const {
  if (layout_id_ == 0 || layout_id_ != to.layout_id || changed_.size() != to.changed.size()) {
    return;
  }
  std::ranges::transform(changed_, to.changed, to.changed.begin(), std::bit_or<>());
  std::vector<image::PdoMark> marks = marks_;
  std::vector<image::PdoMark> scratch;
  image::add_marks(marks, to.marks, scratch);
  to.marks = std::move(marks);
}

}  // namespace linegate::gateway
