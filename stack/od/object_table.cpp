#include "stack/od/object_table.h"

#include <utility>

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
  element = slot.variables[1];
  element.data += std::size_t{element.size} * (sub - 1U);
  return &element;
}

void ObjectTable::insert(std::uint16_t index, Slot slot, ObjectDetails details) {
  if (free_details_.empty()) {
    free_details_.push_back(static_cast<std::uint32_t>(details_.size()));
    details_.emplace_back();
  }
  slot.details = free_details_.back();
  free_details_.pop_back();
  details_[slot.details] = std::make_unique<ObjectDetails>(std::move(details));
  auto& page = pages_[index >> 8U];
  if (page == nullptr) {
    page = std::make_unique<Page>();
  }
  (*page)[index & 0xFFU] = slot;
}

void ObjectTable::erase(std::uint16_t index) {
  Slot& slot = (*pages_[index >> 8U])[index & 0xFFU];
  details_[slot.details].reset();
  free_details_.push_back(slot.details);
  slot = Slot{};
}

std::vector<std::uint16_t> ObjectTable::indices() const {
  std::vector<std::uint16_t> out;
  for (unsigned high = 0; high < 256; ++high) {
    for (unsigned low = 0; pages_[high] != nullptr && low < 256; ++low) {
      if ((*pages_[high])[low].kind != Slot::Kind::none) {
        out.push_back(static_cast<std::uint16_t>(high << 8U | low));
      }
    }
  }
  return out;
}

}  // namespace linegate::od
