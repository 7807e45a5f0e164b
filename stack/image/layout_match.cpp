// SPDX-License-Identifier: Apache-2.0
#include "stack/image/layout_match.h"

#include <algorithm>
#include <bit>
#include <functional>
#include <string>

namespace linegate::image {
namespace {

// A hash of all that says how an image is read. Layouts are foreign, so the ID is not relied on.
std::uint64_t reading_of(const Layout& layout) {
  std::uint64_t hash = 0xCBF2'9CE4'8422'2325U;
  const auto add = [&](std::uint64_t number) {
    hash = (hash ^ number) * 0x0000'0100'0000'01B3U;
    hash ^= hash >> 32U;
  };
  add(layout.byte_size);
  for (const Entry& entry : layout.entries) {
    add(std::hash<std::string>()(entry.name));
    add(entry.bit_offset);
    add(entry.bit_length);
    add(static_cast<std::uint64_t>(entry.type));
    add(std::uint64_t{entry.node} << 32U | std::uint64_t{entry.index} << 8U | entry.sub);
    add(std::hash<std::string>()(entry.scaling.unit));
    add(std::bit_cast<std::uint64_t>(entry.scaling.scale));
    add(std::bit_cast<std::uint64_t>(entry.scaling.offset));
  }
  return hash;
}

}  // namespace

bool LayoutMatch::is_overtaken(const std::optional<Snapshot>& known, const Snapshot& fresh,
                               Instant now) const {
  return known && now - heard_ < kRepair && fresh.sequence < known->sequence &&
         fresh.acquired < known->acquired;
}

void LayoutMatch::take(const std::optional<Layout>& known, const Layout& fresh, Instant now) {
  if (!known) {
    readings_.clear();
  }
  const std::uint64_t reading = reading_of(fresh);
  const auto before =
      std::ranges::find(readings_, fresh.id, [](const auto& one) { return one.first; });
  const bool is_other = before != readings_.end() && before->second != reading;
  if (is_other) {
    changed_ = now;
  } else if (!known || known->id != fresh.id) {  // no image with this ID was read otherwise
    changed_.reset();
    restarted_.reset();
  }
  if (before != readings_.end()) {
    readings_.erase(before);
  } else if (readings_.size() == kMostIds) {
    readings_.erase(readings_.begin());
  }
  readings_.emplace_back(fresh.id, reading);
}

// A line that starts numbers its images from 1.
void LayoutMatch::take(const std::optional<Snapshot>& known, const Snapshot& fresh, Instant now) {
  if (known && known->layout_id == fresh.layout_id && known->sequence == fresh.sequence &&
      known->acquired == fresh.acquired) {
    return;
  }
  if (!known || known->layout_id != fresh.layout_id) {
    began_ = now;
  } else if (fresh.sequence <= known->sequence) {
    began_ = now;
    restarted_ = now;
  }
  heard_ = now;
}

bool LayoutMatch::is_certain(Instant now) const {
  if (restarted_ && now - *restarted_ < kRepair) {
    return false;
  }
  if (!changed_ || now - *changed_ >= kSettled) {
    return true;
  }
  return now - *changed_ >= kRepair &&
         (heard_ - *changed_ >= kRepair || *changed_ - began_ <= kRepair);
}

}  // namespace linegate::image
