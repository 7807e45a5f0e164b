// SPDX-License-Identifier: Apache-2.0
// Construction of a Dictionary: the functions that allocate.
#include <algorithm>
#include <memory>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/od/deferrals.h"
#include "stack/od/object_table.h"
#include "stack/od/objects.h"

namespace linegate::od {
namespace {

constexpr std::size_t kSlack = 8;
constexpr std::size_t kShortestString = 64;
constexpr std::size_t kLongestWindow = 254;

std::size_t round_up(std::size_t size) {
  return (size + 7) / 8 * 8;
}

std::uint32_t capacity_of(const VariableDescription& variable) {
  if (const unsigned fixed = byte_size(variable.type); fixed != 0) {
    return fixed;
  }
  const std::size_t least = variable.type == DataType::domain ? kLongestValue : kShortestString;
  return static_cast<std::uint32_t>(std::max(least, variable.value.size()));
}

bool is_short(const VariableDescription& variable) {
  const unsigned fixed = byte_size(variable.type);
  return variable.sub == 0 && fixed != 0 && fixed <= kLongestShort;
}

// Size of the value in the object's block, in bytes; 0 if the value is kept elsewhere.
std::size_t room_of(const VariableDescription& variable) {
  if (is_short(variable)) {
    return 0;
  }
  return variable.type == DataType::domain ? 0 : round_up(capacity_of(variable) + kSlack);
}

bool makes_sense(const ObjectDescription& object) {
  int last_sub = -1;
  for (const VariableDescription& variable : object.variables) {
    if (variable.sub <= last_sub || variable.sub == kStructureSub ||
        variable.type == DataType::none) {
      return false;
    }
    const unsigned fixed = byte_size(variable.type);
    if (fixed != 0 && variable.value.size() > fixed) {
      return false;
    }
    last_sub = variable.sub;
  }
  return object.index != 0 && !object.variables.empty();
}

// The data type of an object as a whole: for a record its DEFSTRUCT in CiA 301.
std::uint16_t structure_type(const ObjectDescription& object) {
  if (object.type != ObjectType::record) {
    return static_cast<std::uint16_t>(object.variables.back().type);
  }
  const objects::Entry* const entry = objects::find(object.index);
  return entry != nullptr ? entry->structure : std::uint16_t{0};
}

std::array<std::byte, 4> structure(std::uint16_t data_type, ObjectType object_type) {
  std::array<std::byte, 4> out{};
  store_le(std::span<std::byte>(out),
           std::uint64_t{data_type} << 8U | static_cast<std::uint8_t>(object_type));
  return out;
}

VariableDetails details_of(const VariableDescription& variable) {
  VariableDetails details;
  details.name = variable.name;
  details.initial = variable.value;
  if (const unsigned fixed = byte_size(variable.type); fixed != 0) {
    details.initial.resize(fixed);
  }
  details.low = variable.low_limit;
  details.high = variable.high_limit;
  if (variable.type == DataType::domain) {
    details.domain = details.initial;
  }
  return details;
}

Variable variable_of(const VariableDescription& described, VariableDetails& details,
                     std::byte* room) {
  Variable variable;
  variable.size = static_cast<std::uint32_t>(details.initial.size());
  variable.capacity = capacity_of(described);
  variable.type = described.type;
  variable.access = described.access;
  variable.mappable = described.mappable;
  variable.store = described.store;
  variable.has_limits = !described.low_limit.empty() || !described.high_limit.empty();
  variable.data = described.type == DataType::domain ? details.domain.data() : room;
  if (described.type != DataType::domain) {
    std::copy(details.initial.begin(), details.initial.end(), room);
  }
  return variable;
}

// A block of `count` default Variables followed by `room` bytes.
std::unique_ptr<CacheLine[]> make_block(std::size_t count, std::size_t room) {
  const std::size_t bytes = count * sizeof(Variable) + room;
  auto block = std::make_unique<CacheLine[]>((bytes + sizeof(CacheLine) - 1) / sizeof(CacheLine));
  std::uninitialized_value_construct_n(reinterpret_cast<Variable*>(block.get()), count);
  return block;
}

}  // namespace

Dictionary::Dictionary()
    : slots_(std::make_unique<SlotPages>()),
      objects_(std::make_unique<ObjectTable>(*slots_)),
      deferrals_(std::make_unique<Deferrals>()) {
}

Dictionary::Dictionary(const DeviceDescription& device) : Dictionary() {
  for (const ObjectDescription& object : device.objects) {
    (void)add(object);
  }
}

Dictionary::Dictionary(Dictionary&&) noexcept = default;
Dictionary& Dictionary::operator=(Dictionary&&) noexcept = default;
Dictionary::~Dictionary() = default;

Result<void> Dictionary::add(const ObjectDescription& object) {
  if (!makes_sense(object) || has_object(object.index)) {
    return to_error(AbortCode::device_incompatible);
  }
  const std::uint8_t highest = object.variables.back().sub;
  const std::size_t count = highest + std::size_t{1};
  std::size_t room = 0;
  for (const VariableDescription& variable : object.variables) {
    room += room_of(variable);
  }
  ObjectDetails details;
  details.name = object.name;
  details.type = object.type;
  details.structure = structure(structure_type(object), object.type);
  details.variables.resize(count);
  details.block = make_block(count, room);
  auto* variables = reinterpret_cast<Variable*>(details.block.get());
  auto* next = reinterpret_cast<std::byte*>(details.block.get()) + count * sizeof(Variable);
  Slot& slot = objects_->place(object.index);
  for (const VariableDescription& described : object.variables) {
    VariableDetails& cold = details.variables[described.sub];
    cold = details_of(described);
    std::byte* const at = is_short(described) ? objects_->short_value(object.index) : next;
    variables[described.sub] = variable_of(described, cold, at);
    next += room_of(described);
  }
  slot.variables = variables;
  slot.highest = highest;
  slot.kind = Slot::Kind::plain;
  objects_->insert(object.index, std::move(details));
  notify_observers(object.index);
  return {};
}

Result<void> Dictionary::remove(std::uint16_t index) {
  if (!has_object(index)) {
    return to_error(AbortCode::no_object);
  }
  deferrals_->refuse(index, nullptr, AbortCode::no_object);
  objects_->erase(index);
  notify_observers(index);
  return {};
}

Result<void> Dictionary::bind(Address address, std::byte* data, bool kept) {
  Variable element;
  AbortCode why = AbortCode::none;
  Variable* variable = objects_->find(address, element, why);
  if (variable == nullptr) {
    return to_error(why);
  }
  if (objects_->find(address.index)->kind == Slot::Kind::window ||
      variable->type == DataType::domain) {
    return to_error(AbortCode::unsupported_access);
  }
  variable->data = data;
  variable->elsewhere = true;
  objects_->details(address).kept = kept;
  objects_->look_at(address.index);
  notify_observers(address.index);
  return {};
}

Result<void> Dictionary::add_window(std::uint16_t index, DataType type, Access access,
                                    std::byte* data, std::uint8_t count) {
  if (index == 0 || has_object(index) || byte_size(type) == 0 || count > kLongestWindow) {
    return to_error(AbortCode::device_incompatible);
  }
  ObjectDetails details;
  details.type = ObjectType::array;
  details.structure = structure(static_cast<std::uint16_t>(type), ObjectType::array);
  details.block = make_block(2, 0);
  Slot& slot = objects_->place(index);
  std::byte* const value = objects_->short_value(index);
  *value = std::byte{count};
  auto* variables = reinterpret_cast<Variable*>(details.block.get());
  variables[0] = Variable{.data = value,
                          .size = 1,
                          .capacity = 1,
                          .type = DataType::unsigned8,
                          .access = Access::constant};
  const std::uint32_t size = byte_size(type);
  variables[1] = Variable{.data = data,
                          .size = size,
                          .capacity = size,
                          .type = type,
                          .access = access,
                          .mappable = true,
                          .elsewhere = true};
  slot.variables = variables;
  slot.highest = count;
  slot.kind = Slot::Kind::window;
  objects_->insert(index, std::move(details));
  notify_observers(index);
  return {};
}

Result<void> Dictionary::set_store(Address address, bool store) {
  Variable element;
  AbortCode why = AbortCode::none;
  Variable* variable = objects_->find(address, element, why);
  if (variable == nullptr) {
    return to_error(why);
  }
  if (objects_->find(address.index)->kind == Slot::Kind::window) {
    return to_error(AbortCode::unsupported_access);
  }
  variable->store = store;
  return {};
}

}  // namespace linegate::od
