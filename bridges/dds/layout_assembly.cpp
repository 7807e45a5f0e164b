// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/layout_assembly.h"

#include <algorithm>

#include "bridges/dds/image_samples.h"

namespace linegate::dds {
namespace {

constexpr std::size_t kMaxParts = kMaxEntries / kMaxLayoutPart;
constexpr std::size_t kMaxLayouts = 4'096;  // of all gateways: 2048 lines

bool within(const v1::LayoutEntry& entry, std::uint32_t byte_size) {
  const std::uint64_t end = std::uint64_t{entry.bit_offset()} + entry.bit_length();
  return end <= std::uint64_t{byte_size} * 8;
}

bool plausible(const v1::ImageLayout& part) {
  return part.direction() <= v1::DIRECTION_OUTPUTS && part.part() < part.parts() &&
         part.parts() <= kMaxParts && part.entries().size() <= kMaxLayoutPart &&
         part.byte_size() <= image::kMaxAreaBytes &&
         std::ranges::all_of(part.entries(), [&](const v1::LayoutEntry& entry) {
           return within(entry, part.byte_size()) && is_plausible(entry);
         });
}

bool same_layout(const v1::ImageLayout& a, const v1::ImageLayout& b) {
  return a.incarnation() == b.incarnation() && a.layout_id() == b.layout_id() &&
         a.parts() == b.parts() && a.byte_size() == b.byte_size() &&
         a.entry_count() == b.entry_count();
}

}  // namespace

// Whether all parts of the layout of `part` were received and their entries are contiguous.
bool LayoutAssembly::complete(const Known& known, const v1::ImageLayout& part) {
  std::size_t entries = 0;
  for (std::uint16_t number = 0; number < part.parts(); ++number) {
    const auto other = known.parts.find(number);
    if (other == known.parts.end() || !same_layout(other->second, part) ||
        other->second.first_entry() != entries) {
      return false;
    }
    entries += other->second.entries().size();
  }
  return entries == part.entry_count();
}

bool LayoutAssembly::take(const v1::ImageLayout& part, image::Layout& out) {
  if (!plausible(part))
    return false;
  const Key key{part.gateway().to_string(), part.line().to_string(), part.direction()};
  if (layouts_.size() >= kMaxLayouts && !layouts_.contains(key))
    return false;
  Known& known = layouts_[key];
  const auto same = known.parts.find(part.part());
  const bool is_returned = known.incarnation == part.incarnation() &&
                           known.layout_id == part.layout_id() && same != known.parts.end();
  if (is_returned && same->second == part)
    return false;
  known.parts[part.part()] = part;
  if (!complete(known, part))
    return false;
  out = image::Layout{};
  out.direction = static_cast<image::Direction>(part.direction());
  out.id = part.layout_id();
  out.byte_size = part.byte_size();
  for (std::uint16_t number = 0; number < part.parts(); ++number) {
    for (const v1::LayoutEntry& entry : known.parts[number].entries()) {
      from_wire(entry, out.entries.emplace_back());
    }
  }
  known.incarnation = part.incarnation();
  known.layout_id = part.layout_id();
  return true;
}

}  // namespace linegate::dds
