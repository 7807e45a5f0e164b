// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/direct_images.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "gateway/runtime/image_record.h"
#include "stack/base/assert.h"

namespace linegate::gateway {
namespace {

std::size_t highest_pdo(const image::Layout& layout) {
  std::size_t out = 0;
  for (const image::Entry& entry : layout.entries) {
    out = std::max<std::size_t>(out, entry.local_pdo);
  }
  return out;
}

std::array<std::size_t, 2> longest_records(const std::array<image::Layout, 2>& layouts) {
  return {longest_record(layouts[0], highest_pdo(layouts[0])),
          longest_record(layouts[1], highest_pdo(layouts[1]))};
}

}  // namespace

UpdateWakes::UpdateWakes(Duration min_period, const image::Layout& inputs)
    : min_period_(min_period), due_(highest_pdo(inputs) + 1) {
}

[[gnu::hot]] bool UpdateWakes::due(const image::Snapshot& inputs, Instant now) {
  bool any = false;
  for (const image::PdoMark& mark : inputs.marks) {
    LINEGATE_ASSERT(mark.local_pdo < due_.size(), "the PDO is in the layout");
    if (Instant& due = due_[mark.local_pdo]; now >= due) {
      due = now + min_period_;
      any = true;
    }
  }
  return any;
}

DirectImages::DirectImages(const config::LinePlan& plan,
                           const std::array<image::Layout, 2>& layouts,
                           std::shared_ptr<exchange::Bell> bell)
    : rule_(plan.publish.rule),
      bell_(std::move(bell)),
      wakes_(plan.pdo_min_period, layouts[0]),
      records_(longest_records(layouts)) {
  std::size_t most = 0;
  for (std::size_t i = 0; i < sides_.size(); ++i) {
    const std::size_t pdos = highest_pdo(layouts[i]);
    sides_[i].marks.reserve(pdos);
    sides_[i].snapshot.marks.reserve(pdos);
    sides_[i].changed.resize((layouts[i].entries.size() + 63) / 64);
    sides_[i].published.reserve(layouts[i].entries.size());
    most = std::max(most, pdos);
  }
  scratch_.reserve(most);
  unread_.reserve(most);
}

[[gnu::hot]] bool DirectImages::is_wanted(const Side& side) const {
  return rule_ != config::Publish::Rule::on_change ||
         side.published.differs(side.snapshot, side.changed);
}

[[gnu::hot]] bool DirectImages::taken(image::Direction direction, const ClockMap& clock,
                                      Instant now,
                                      exchange::Handover<image::Snapshot>& to_publisher) {
  Side& of = side(direction);
  bool wakes = false;
  if (direction == image::Direction::inputs) {
    hand_over(of.snapshot, to_publisher);
    wakes = wakes_.due(of.snapshot, now);
  }
  image::add_marks(of.marks, of.snapshot.marks, scratch_);
  std::ranges::transform(of.changed, of.snapshot.changed, of.changed.begin(), std::bit_or<>());
  publish(direction, clock, now);
  return wakes;
}

[[gnu::hot]] void DirectImages::publish(image::Direction direction, const ClockMap& clock,
                                        Instant now) {
  Side& of = side(direction);
  if (!is_wanted(of)) {
    of.retry = kNever;
    return;
  }
  const auto series = static_cast<std::size_t>(direction);
  const std::span<std::byte> record = records_.draft(series);
  if (record.empty()) {
    of.waiting_since = of.retry == kNever ? now : of.waiting_since;
    of.retry = now + (now - of.waiting_since < kLate ? kRetry : kLateRetry);
    return;
  }
  of.retry = kNever;
  of.snapshot.marks.swap(of.marks);
  of.snapshot.changed.swap(of.changed);
  records_.publish(series, write_record(of.snapshot, clock, record));
  of.published.set(of.snapshot);
  of.marks.clear();
  std::ranges::fill(of.changed, 0);
  news_ = true;
}

void DirectImages::publish_waiting(image::Direction direction, const ClockMap& clock, Instant now) {
  if (side(direction).retry <= now) {
    publish(direction, clock, now);
  }
}

// An unread one is taken back: its receptions are not lost.
[[gnu::hot]] void DirectImages::hand_over(const image::Snapshot& inputs,
                                          exchange::Handover<image::Snapshot>& to) {
  const auto draft = to.draft();
  unread_.clear();
  if (draft.unread) {
    unread_.swap(draft.value.marks);
  }
  image::add_marks(unread_, inputs.marks, scratch_);
  draft.value = inputs;
  draft.value.marks.assign(unread_.begin(), unread_.end());
  to.publish();
}

[[gnu::hot]] void DirectImages::announce() {
  if (std::exchange(news_, false)) {
    bell_->ring();
  }
}

}  // namespace linegate::gateway
