#include "bridges/dds/layout_assembly.h"

#include "bridges/dds/image_samples.h"

namespace linegate::dds {
namespace {

bool plausible(const v1::ImageLayout& part) {
  return part.direction() <= v1::DIRECTION_OUTPUTS && part.part() < part.parts() &&
         part.entries().size() <= kMaxLayoutPart && part.byte_size() <= image::kMaxAreaBytes;
}

}  // namespace

bool LayoutAssembly::take(const v1::ImageLayout& part, image::Layout& out) {
  if (!plausible(part))
    return false;
  Partial& partial =
      layouts_[{part.gateway().to_string(), part.line().to_string(), part.direction()}];
  if (partial.incarnation != part.incarnation() || partial.layout_id != part.layout_id()) {
    partial = Partial{part.incarnation(), part.layout_id(), false, {}};
  }
  if (partial.complete)
    return false;
  partial.parts[part.part()] = part;
  if (partial.parts.size() != part.parts())
    return false;

  out = image::Layout{};
  out.direction = static_cast<image::Direction>(part.direction());
  out.id = part.layout_id();
  out.byte_size = part.byte_size();
  for (const auto& [number, each] : partial.parts) {
    for (const v1::LayoutEntry& entry : each.entries()) {
      from_wire(entry, out.entries.emplace_back());
    }
  }
  partial.parts.clear();
  partial.complete = true;
  return true;
}

}  // namespace linegate::dds
