// SPDX-License-Identifier: Apache-2.0
#include "stack/line/own_objects.h"

#include <algorithm>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/image/limits.h"
#include "stack/image/network_variables.h"
#include "stack/image/scaling.h"
#include "stack/od/data_type.h"
#include "stack/od/objects.h"

namespace linegate::line {
namespace {

constexpr std::uint8_t kMostSubs = 0xFE;

std::string address_text(od::Address address) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string out;
  for (unsigned shift = 16; shift > 0; shift -= 4) {
    out += kDigits[address.index >> (shift - 4) & 0xFU];
  }
  return out + ':' + kDigits[address.sub >> 4U] + kDigits[address.sub & 0xFU];
}

// Sub-index 0 holds the highest sub-index.
od::VariableDescription highest_sub(std::uint8_t highest) {
  od::VariableDescription out;
  out.name = "Highest sub-index supported";
  out.type = od::DataType::unsigned8;
  out.access = od::Access::constant;
  out.value = {std::byte{highest}};
  return out;
}

std::vector<std::byte> listed_value(std::span<const std::byte> value) {
  return value.size() <= ListedObject::kLongestValue ? std::vector(value.begin(), value.end())
                                                     : std::vector<std::byte>();
}

void list_variable(const od::Dictionary& dictionary, od::Address address,
                   std::vector<ListedObject>& out) {
  const auto variable = dictionary.find(address);
  if (!variable) {
    return;
  }
  const auto value = dictionary.read(address);
  out.push_back({.address = address,
                 .type = variable->type,
                 .access = variable->access,
                 .mappable = variable->mappable,
                 .stored = variable->store,
                 .application = is_own_index(address.index),
                 .name = std::string(dictionary.name(address)),
                 .value = value.ok() ? listed_value(*value) : std::vector<std::byte>()});
}

// An object without a default starts with 0, which its limits need not include.
AbortCode limits_of(const od::VariableDescription& variable) {
  const bool given = !variable.value.empty();
  const auto& any = given ? variable.value : variable.low_limit;
  return any.empty()
             ? AbortCode::none
             : od::check_limits(variable.type, any, variable.low_limit, variable.high_limit);
}

}  // namespace

std::string_view fault_of(const OwnObject& object) {
  const od::VariableDescription& variable = object.variable;
  const std::size_t size = od::byte_size(variable.type);
  const auto fits = [size](const std::vector<std::byte>& value) {
    return value.empty() || value.size() == size;
  };
  if (!is_own_index(object.index)) {
    return "is not in 2000h..5EFFh or 6000h..9FFFh";
  }
  if (variable.sub > kMostSubs) {
    return "has no such sub-index";
  }
  if (size == 0 && !od::is_string(variable.type)) {
    return "has no data type that an application may use";
  }
  if (variable.type == od::DataType::boolean && object.in_image) {
    return "is a BOOLEAN, which the image stores as a bit: use UNSIGNED8";
  }
  if (size == 0 && (variable.mappable || object.in_image)) {
    return "has no fixed length: it is neither in a PDO nor in the image";
  }
  if (size != 0 &&
      (!fits(variable.value) || !fits(variable.low_limit) || !fits(variable.high_limit))) {
    return "has a value or limit of another length than its data type";
  }
  switch (limits_of(variable)) {
    case AbortCode::none:
      break;
    case AbortCode::max_less_than_min:
      return "has a lower limit above the upper one";
    default:
      return "has a default beyond its limits";
  }
  return {};
}

std::vector<Diagnostic> check_own_objects(const LineConfig& config) {
  std::vector<Diagnostic> out;
  const auto report = [&](const OwnObject& object, std::string_view what) {
    out.push_back({.severity = Severity::error,
                   .file = config.name,
                   .text = "own object " + address_text({object.index, object.variable.sub}) + ' ' +
                           std::string(what)});
  };
  std::map<od::Address, unsigned> seen;
  for (const OwnObject& object : config.own_objects) {
    if (const std::string_view fault = fault_of(object); !fault.empty()) {
      report(object, fault);
    }
    if (++seen[{object.index, object.variable.sub}] == 2) {
      report(object, "is there twice");
    }
  }
  return out;
}

bool place_own_objects(const LineConfig& config, pdo::LinkPlan& plan) {
  std::map<od::Address, const OwnObject*> ordered;
  for (const OwnObject& object : config.own_objects) {
    if (object.in_image) {
      ordered.emplace(od::Address{object.index, object.variable.sub}, &object);
    }
  }
  for (const auto& [address, object] : ordered) {
    const image::Direction direction = direction_of(object->variable.access);
    image::Layout& layout = direction == image::Direction::inputs ? plan.inputs : plan.outputs;
    const std::uint32_t size = od::byte_size(object->variable.type);
    const std::uint32_t offset = (layout.byte_size + size - 1) / size * size;
    image::Entry entry;
    entry.bit_offset = offset * 8;
    entry.bit_length = static_cast<std::uint16_t>(size * 8);
    entry.type = object->variable.type;
    entry.node = config.node_id;
    entry.index = address.index;
    entry.sub = address.sub;
    image::describe_value(object->variable, entry);
    entry.name = "own." + object->variable.name;
    if (const auto shown =
            image::variable_address(direction, entry.type, entry.bit_offset, entry.bit_length)) {
      entry.variable_index = shown->index;
      entry.variable_sub = shown->sub;
    }
    layout.entries.push_back(std::move(entry));
    layout.byte_size = offset + size;
    layout.id = image::layout_id(layout);
  }
  image::make_names_unique(plan.inputs);
  image::make_names_unique(plan.outputs);
  const auto fits = [](const image::Layout& layout) {
    return layout.byte_size <= image::kMaxAreaBytes && layout.entries.size() <= image::kMaxEntries;
  };
  return fits(plan.inputs) && fits(plan.outputs);
}

OwnObjects::OwnObjects(const std::vector<OwnObject>& objects, image::ProcessImage& image,
                       EventLog& events)
    : image_(image), events_(events) {
  for (const OwnObject& object : objects) {
    const od::Address address{object.index, object.variable.sub};
    objects_.emplace(address, object);
    configured_.insert(address.index);
    if (!object.in_image) {
      continue;
    }
    if (const auto place = configured_place(address)) {
      places_.emplace(address, *place);
    }
  }
}

std::optional<OwnObjects::Place> OwnObjects::configured_place(od::Address address) const {
  const image::Direction direction = direction_of(objects_.at(address).variable.access);
  for (const image::Entry& entry : image_.layout(direction).entries) {
    if (entry.local_pdo == 0 && entry.index == address.index && entry.sub == address.sub) {
      return Place{direction, entry.bit_offset / 8U, entry.bit_length / 8U};
    }
  }
  return std::nullopt;
}

Result<void> OwnObjects::add_to(od::Dictionary& dictionary) {
  // The bytes of the image are the value of the object, so the default is written there first.
  for (const auto direction : {image::Direction::inputs, image::Direction::outputs}) {
    const auto& entries = image_.layout(direction).entries;
    for (std::uint32_t i = 0; i < entries.size(); ++i) {
      const auto known = objects_.find({entries[i].index, entries[i].sub});
      if (entries[i].local_pdo == 0 && known != objects_.end()) {
        const std::vector<std::byte>& value = known->second.variable.value;
        image_.write_entry(direction, i, load_le(std::span<const std::byte>(value)));
      }
    }
  }
  std::uint16_t last = 0;
  for (const auto& [address, object] : objects_) {
    if (std::exchange(last, address.index) == address.index) {
      continue;
    }
    Result<void> added = add_index(dictionary, address.index);
    if (!added.ok()) {
      return added;
    }
  }
  return {};
}

Result<void> OwnObjects::add_index(od::Dictionary& dictionary, std::uint16_t index) {
  od::ObjectDescription object{.index = index};
  const auto begin = objects_.lower_bound({index, 0});
  const auto end = objects_.upper_bound({index, 0xFF});
  for (auto it = begin; it != end; ++it) {
    object.variables.push_back(it->second.variable);
  }
  const std::uint8_t highest = object.variables.back().sub;
  if (highest != 0 && object.variables.front().sub != 0) {
    object.variables.insert(object.variables.begin(), highest_sub(highest));
  }
  object.type = highest == 0 ? od::ObjectType::variable : od::ObjectType::record;
  object.name = highest == 0 ? object.variables.front().name : "Application object";
  Result<void> done = dictionary.add(object);
  for (auto it = begin; it != end && done.ok(); ++it) {
    if (const auto place = places_.find(it->first); place != places_.end()) {
      std::byte* const data = image_.area(place->second.direction).data() + place->second.offset;
      done = dictionary.bind(it->first, data);
    }
  }
  return done.ok() ? dictionary.set_hook(index, this) : done;
}

Error OwnObjects::create(od::Dictionary& dictionary, OwnObject object) {
  const od::Address address{object.index, object.variable.sub};
  const std::uint32_t size = od::byte_size(object.variable.type);
  const image::Direction direction = direction_of(object.variable.access);
  const bool outside = object.in_image && (object.offset > image_.area(direction).size() ||
                                           size > image_.area(direction).size() - object.offset);
  if (!fault_of(object).empty() || object.variable.store || outside) {
    return to_error(Refusal::bad_request);
  }
  const bool known = dictionary.has_object(object.index);
  const auto first = objects_.lower_bound({object.index, 0});
  const bool ours = first != objects_.end() && first->first.index == object.index;
  if (objects_.contains(address) || (known && !ours)) {
    return to_error(Refusal::wrong_state);
  }
  std::map<od::Address, std::vector<std::byte>> values;
  for (auto it = first; it != objects_.end() && it->first.index == object.index; ++it) {
    if (const auto variable = dictionary.find(it->first)) {
      values[it->first].assign(variable->bytes().begin(), variable->bytes().end());
    }
  }
  if (object.in_image) {
    places_[address] = {direction, object.offset, size};
  }
  objects_.emplace(address, std::move(object));
  if (known) {
    (void)dictionary.remove(address.index);
  }
  const bool added = add_index(dictionary, address.index).ok();
  if (!added) {
    objects_.erase(address);
    places_.erase(address);
    if (known) {
      (void)add_index(dictionary, address.index);
    }
  }
  for (const auto& [kept, value] : values) {
    dictionary.restore(kept, value);
  }
  return added ? Error{} : to_error(Refusal::bad_request);
}

Error OwnObjects::remove(od::Dictionary& dictionary, std::uint16_t index) {
  if (configured_.contains(index)) {
    return to_error(Refusal::wrong_state);
  }
  const auto of_index = [index](const auto& one) { return one.first.index == index; };
  if (std::erase_if(objects_, of_index) == 0) {
    return to_error(Refusal::unknown_entry);
  }
  std::erase_if(places_, of_index);
  (void)dictionary.remove(index);
  return {};
}

void OwnObjects::values_reset() {
  for (const auto& [address, place] : places_) {
    mark(place);
  }
}

// A value in the image needs no event.
AbortCode OwnObjects::execute_write(od::Address address, std::span<const std::byte> value) {
  if (!by_itself_ && !places_.contains(address)) {
    events_.emit({.time = now_, .data = written_event(address, value)});
  }
  return AbortCode::none;
}

void OwnObjects::written(od::Address address) {
  if (const auto place = places_.find(address); place != places_.end()) {
    mark(place->second);
  }
}

void OwnObjects::mark(const Place& place) {
  image_.mark_written(place.direction, place.offset * 8, place.size * 8);
}

event::ObjectWritten written_event(od::Address address, std::span<const std::byte> value) {
  event::ObjectWritten out{
      .size = static_cast<std::uint32_t>(value.size()), .index = address.index, .sub = address.sub};
  std::ranges::copy(value.first(std::min(value.size(), out.data.size())), out.data.begin());
  return out;
}

std::vector<ListedObject> list_objects(const od::Dictionary& dictionary, ObjectRange range) {
  std::vector<ListedObject> out;
  for (const std::uint16_t index : dictionary.indices()) {
    const bool window =
        index >= od::objects::kInputVariables && index <= od::objects::kLastNetworkVariable;
    if (index < range.first || index > range.last ||
        (window && range.first < od::objects::kInputVariables)) {
      continue;
    }
    for (unsigned sub = 0; sub <= dictionary.highest_sub(index).value_or(0); ++sub) {
      list_variable(dictionary, {index, static_cast<std::uint8_t>(sub)}, out);
    }
  }
  return out;
}

std::vector<ListedObject> list_objects(const od::DeviceDescription& device, ObjectRange range) {
  std::vector<ListedObject> out;
  for (const od::ObjectDescription& object : device.objects) {
    if (object.index < range.first || object.index > range.last) {
      continue;
    }
    for (const od::VariableDescription& variable : object.variables) {
      out.push_back({.address = {object.index, variable.sub},
                     .type = variable.type,
                     .access = variable.access,
                     .mappable = variable.mappable,
                     .stored = variable.store,
                     .name = variable.name,
                     .value = listed_value(variable.value)});
    }
  }
  return out;
}

}  // namespace linegate::line
