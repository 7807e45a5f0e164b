// SPDX-License-Identifier: Apache-2.0
// Look-up, and queries about the content of a Dictionary.
#include "stack/od/dictionary.h"

#include "stack/od/object_table.h"

namespace linegate::od {

bool Dictionary::has_object(std::uint16_t index) const {
  return objects_->find(index) != nullptr;
}

std::optional<Variable> Dictionary::find(Address address, AbortCode* why) const {
  Variable element;
  AbortCode reason = AbortCode::none;
  const Variable* variable = objects_->find(address, element, reason);
  if (variable != nullptr) {
    return *variable;
  }
  if (why != nullptr) {
    *why = reason;
  }
  return std::nullopt;
}

std::optional<std::uint8_t> Dictionary::highest_sub(std::uint16_t index) const {
  const Slot* slot = objects_->find(index);
  return slot == nullptr ? std::nullopt : std::optional(slot->highest);
}

std::vector<std::uint16_t> Dictionary::indices() const {
  return objects_->indices();
}

std::string_view Dictionary::name(Address address) const {
  Variable element;
  AbortCode why = AbortCode::none;
  if (objects_->find(address, element, why) == nullptr) {
    return {};
  }
  const ObjectDetails& object = objects_->details(*objects_->find(address.index));
  if (address.sub < object.variables.size() && !object.variables[address.sub].name.empty()) {
    return object.variables[address.sub].name;
  }
  return address.sub == 0 ? std::string_view(object.name) : std::string_view();
}

std::span<const std::byte> Dictionary::initial_value(Address address) const {
  return objects_->find_plain(address) == nullptr
             ? std::span<const std::byte>()
             : std::span<const std::byte>(objects_->details(address).initial);
}

std::vector<Address> Dictionary::stored(std::uint16_t first, std::uint16_t last) const {
  std::vector<Address> out;
  for (const std::uint16_t index : objects_->indices()) {
    const Slot& slot = *objects_->find(index);
    for (unsigned sub = 0; index >= first && index <= last && sub <= slot.highest; ++sub) {
      const Address address{index, static_cast<std::uint8_t>(sub)};
      const Variable* variable = objects_->find_plain(address);
      if (variable != nullptr && variable->store) {
        out.push_back(address);
      }
    }
  }
  return out;
}

ObjectType Dictionary::object_type(std::uint16_t index) const {
  const Slot* slot = objects_->find(index);
  return slot == nullptr ? ObjectType::null : objects_->details(*slot).type;
}

}  // namespace linegate::od
