// Look-up, and what a Dictionary tells about itself.
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

ObjectType Dictionary::object_type(std::uint16_t index) const {
  const Slot* slot = objects_->find(index);
  return slot == nullptr ? ObjectType::null : objects_->details(*slot).type;
}

}  // namespace linegate::od
