// SPDX-License-Identifier: Apache-2.0
#include "stack/routing/forward_objects.h"

#include <algorithm>
#include <string>
#include <utility>

#include "stack/pdo/link.h"
#include "stack/pdo/record.h"

namespace linegate::routing {
namespace {

bool is_whole_bytes(const image::Entry& entry) {
  return entry.bit_offset % 8 == 0 && entry.bit_length % 8 == 0;
}

od::Access access_of(const ForwardedObject& object, bool shown) {
  const bool output = object.entry && object.entry->direction == image::Direction::outputs;
  if (shown || output) {
    return od::Access::ro;
  }
  return object.entry ? od::Access::rww : od::Access::rw;
}

}  // namespace

ForwardObjects::ForwardObjects(const Forwarding& config, image::ProcessImage& image)
    : config_(config), image_(image), lists_(config.objects.size()) {
}

Result<void> ForwardObjects::add_to(od::Dictionary& dictionary) {
  std::vector<ForwardedObject> objects = config_.objects;
  std::ranges::sort(objects, {}, &ForwardedObject::address);
  for (std::size_t first = 0; first < objects.size();) {
    std::size_t last = first;
    while (last < objects.size() && objects[last].address.index == objects[first].address.index) {
      ++last;
    }
    const auto of_index = std::span(objects).subspan(first, last - first);
    for (const bool shown : {false, true}) {
      Result<void> added = add_index(dictionary, of_index, shown);
      if (!added.ok()) {
        return added;
      }
    }
    first = last;
  }
  for (const auto& [kind, pdos] : {std::pair(pdo::PdoKind::rpdo, &config_.rpdos),
                                   std::pair(pdo::PdoKind::tpdo, &config_.tpdos)}) {
    for (const pdo::Parameters& parameters : *pdos) {
      Result<void> added = pdo::add_own_pdo(dictionary, kind, parameters);
      if (!added.ok()) {
        return added;
      }
    }
  }
  return {};
}

Result<void> ForwardObjects::add_index(od::Dictionary& dictionary,
                                       std::span<const ForwardedObject> objects, bool shown) {
  const auto address_of = [shown](const ForwardedObject& object) {
    return shown ? shown_address(object.address) : object.address;
  };
  od::ObjectDescription array;
  array.index = address_of(objects.front()).index;
  array.name = shown ? "Forwarded values, read-only" : "Forwarded values";
  array.type = od::ObjectType::array;
  array.variables.push_back({.sub = 0,
                             .name = "Highest sub-index supported",
                             .type = od::DataType::unsigned8,
                             .access = od::Access::constant,
                             .value = {std::byte{objects.back().address.sub}}});
  for (const ForwardedObject& object : objects) {
    array.variables.push_back({.sub = object.address.sub,
                               .name = object.name,
                               .type = *forward_type(object.address),
                               .access = access_of(object, shown),
                               .mappable = true});
  }
  Result<void> done = dictionary.add(array);
  for (const ForwardedObject& object : objects) {
    std::byte* data = nullptr;
    if (object.entry) {
      const image::Entry& entry =
          image_.layout(object.entry->direction).entries[object.entry->number];
      data = is_whole_bytes(entry)
                 ? image_.area(object.entry->direction).data() + entry.bit_offset / 8
                 : nullptr;
    } else if (shown && done.ok()) {
      data = dictionary.find(object.address)->data;
    }
    if (data != nullptr && done.ok()) {
      done = dictionary.bind(address_of(object), data, object.entry.has_value());
    }
  }
  return done.ok() ? dictionary.set_hook(array.index, this) : done;
}

const ForwardedObject* ForwardObjects::find(od::Address address) const {
  const auto found = std::ranges::find_if(config_.objects, [&](const ForwardedObject& object) {
    return object.entry && (object.address == address || shown_address(object.address) == address);
  });
  return found == config_.objects.end() ? nullptr : &*found;
}

// Refreshes values of less than a byte, which the dictionary cannot read in the image.
AbortCode ForwardObjects::before_read(od::Address address, const od::Variable& variable) {
  const ForwardedObject* const object = find(address);
  if (object != nullptr) {
    const auto [direction, number] = *object->entry;
    if (!is_whole_bytes(image_.layout(direction).entries[number])) {
      *variable.data = static_cast<std::byte>(image_.read_entry(direction, number));
    }
  }
  return AbortCode::none;
}

void ForwardObjects::written(od::Address address) {
  const ForwardedObject* const object = find(address);
  if (object == nullptr) {
    return;
  }
  const auto [direction, number] = *object->entry;
  const image::Entry& entry = image_.layout(direction).entries[number];
  if (is_whole_bytes(entry)) {
    image_.mark_written(direction, entry.bit_offset, entry.bit_length);
  }
}

void ForwardObjects::rebuild(const od::Dictionary& dictionary) {
  for (List& list : lists_) {
    list = {};
  }
  for (const pdo::Parameters& rpdo : config_.rpdos) {
    note(dictionary, pdo::PdoKind::rpdo, rpdo.number);
  }
  for (const pdo::Parameters& tpdo : config_.tpdos) {
    note(dictionary, pdo::PdoKind::tpdo, tpdo.number);
  }
}

void ForwardObjects::note(const od::Dictionary& dictionary, pdo::PdoKind kind,
                          std::uint16_t number) {
  const auto record = static_cast<std::uint16_t>(pdo::communication_base(kind) + number - 1);
  const can::CobId cob_id{
      static_cast<std::uint32_t>(dictionary.number({record, 1}).value_or(can::CobId::kInvalidBit))};
  if (!cob_id.valid()) {
    return;
  }
  for (const pdo::Mapping& mapping : pdo::read_mapping(dictionary, kind, number)) {
    for (std::size_t i = 0; i < config_.objects.size(); ++i) {
      const od::Address object = config_.objects[i].address;
      if (mapping.address == object || mapping.address == shown_address(object)) {
        (kind == pdo::PdoKind::rpdo ? lists_[i].rpdos : lists_[i].tpdos).push_back(number);
      }
    }
  }
}

}  // namespace linegate::routing
