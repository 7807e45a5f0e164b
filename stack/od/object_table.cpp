// SPDX-License-Identifier: Apache-2.0
#include "stack/od/object_table.h"

#include <algorithm>
#include <utility>

#include "stack/base/assert.h"

namespace linegate::od {

Variable* ObjectTable::window_element(const Slot& slot, std::uint8_t sub, Variable& element,
                                      AbortCode& why) {
  if (sub > slot.highest) {
    why = AbortCode::no_sub_index;
    return nullptr;
  }
  if (sub == 0) {
    return slot.variables;
  }
  LINEGATE_ASSERT(slot.kind == Slot::Kind::window, "the object is a window");
  element = slot.variables[1];
  element.data += std::size_t{element.size} * (sub - 1U);
  return &element;
}

void ObjectTable::insert(std::uint16_t index, ObjectDetails details) {
  Slot& slot = slots_.place(index);
  if (free_details_.empty()) {
    free_details_.push_back(static_cast<std::uint32_t>(details_.size()));
    details_.emplace_back();
  }
  slot.details = free_details_.back();
  free_details_.pop_back();
  details_[slot.details] = std::make_unique<ObjectDetails>(std::move(details));
  look_at(index);
}

void ObjectTable::look_at(std::uint16_t index) {
  LINEGATE_ASSERT(find(index) != nullptr, "there is an object");
  constexpr std::uint32_t kLongestGlance = 4;
  const Variable& first = slots_.place(index).variables[0];
  const bool possible = first.data == slots_.value(index).data() && first.hook == nullptr &&
                        readable(first.access) && first.size <= kLongestGlance;
  if (possible) {
    std::fill(slots_.value(index).begin() + first.size, slots_.value(index).end(), std::byte{0});
  }
  slots_.set_glance(index, possible ? static_cast<std::uint8_t>(first.size) : std::uint8_t{0});
}

void ObjectTable::erase(std::uint16_t index) {
  LINEGATE_ASSERT(find(index) != nullptr, "there is an object");
  const Slot& slot = slots_.place(index);
  details_[slot.details].reset();
  free_details_.push_back(slot.details);
  slots_.clear(index);
}

std::vector<std::uint16_t> ObjectTable::indices() const {
  std::vector<std::uint16_t> out;
  for (unsigned index = 0; index <= 0xFFFF; ++index) {
    if (!slots_.has_page(static_cast<std::uint16_t>(index))) {
      index |= 0xFFU;
    } else if (find(static_cast<std::uint16_t>(index)) != nullptr) {
      out.push_back(static_cast<std::uint16_t>(index));
    }
  }
  return out;
}

}  // namespace linegate::od
