// SPDX-License-Identifier: Apache-2.0
// Objects that are added, removed or moved at run time, and RPDOs with objects that a hook watches.
#include "stack/image/network_variables.h"
#include "stack/pdo/engine_impl.h"

namespace linegate::pdo {

// A PDO that maps a removed object becomes inactive, which is reported; it becomes active again
// when the object is added again.
void Engine::Impl::reshaped(std::uint16_t index) {
  if (record_index(index)) {
    (void)dictionary.set_hook(index, this);  // the object may be missing
  }
  follow_sources();
  std::vector<std::pair<PdoKind, std::uint16_t>> touched;
  for (const PdoKind kind : {PdoKind::rpdo, PdoKind::tpdo}) {
    const std::size_t count = kind == PdoKind::rpdo ? rpdos.size() : tpdos.size();
    for (std::size_t number = 1; number <= count; ++number) {
      if (depends_on(kind, static_cast<std::uint16_t>(number), index)) {
        touched.emplace_back(kind, static_cast<std::uint16_t>(number));
      }
    }
  }
  if (touched.empty()) {
    return;
  }
  for (const auto& [kind, number] : touched) {
    compile(kind, number);
  }
  lay_out();
  for (const auto& [kind, number] : touched) {
    if (operational) {
      begin(kind, static_cast<std::uint16_t>(number - 1U));
    }
  }
}

// Makes the dictionary report changes of exactly the values that TPDOs with auto-notify send. The
// mark of a value that a single TPDO sends is the number of that TPDO.
void Engine::Impl::follow_sources() {
  for (const Followed& value : followed) {
    (void)dictionary.follow(value.address, 0);  // the object may be removed
  }
  followed.clear();
  if (auto_notify.none()) {
    return;
  }
  for (const ObjectSource& source : object_sources.all()) {
    if (!auto_notify[source.slot]) {
      continue;
    }
    if (!followed.empty() && followed.back().address == source.address) {
      followed.back().mark = od::kSharedMark;
    } else {
      followed.push_back({source.address, static_cast<od::FollowMark>(source.slot + 1)});
    }
  }
  for (const Source& source : sources) {
    if (auto_notify[source.slot]) {
      for (const od::Address shown :
           image::variables_showing(image::Direction::outputs, source.begin, source.end)) {
        followed.push_back({shown, od::kSharedMark});
      }
    }
  }
  if (source_tpdo && auto_notify[*source_tpdo]) {
    scanner_list.for_each([this](od::Address address) {
      followed.push_back({address, od::kSharedMark});
    });
  }
  for (const Followed& value : followed) {
    (void)dictionary.follow(value.address, value.mark);
  }
}

bool Engine::Impl::depends_on(PdoKind kind, std::uint16_t number, std::uint16_t index) const {
  const unsigned offset = number - 1U;
  if (index == communication_base(kind) + offset || index == mapping_base(kind) + offset) {
    return true;
  }
  const std::vector<Mapping> mappings = read_mapping(dictionary, kind, number);
  return std::ranges::any_of(
      mappings, [&](const Mapping& mapping) { return mapping.address.index == index; });
}

std::vector<od::Address> Engine::Impl::watched_objects(std::uint16_t rpdo) const {
  std::vector<od::Address> out;
  for (const Mapping& mapping : read_mapping(dictionary, PdoKind::rpdo, rpdo)) {
    const auto variable = dictionary.find(mapping.address);
    if (variable && variable->watched && !is_dummy(mapping)) {
      out.push_back(mapping.address);
    }
  }
  return out;
}

// A hook may change PDOs, including this one.
void Engine::Impl::notify_watched(std::uint16_t slot) {
  for (std::size_t i = 0; slot < details.size() && i < details[slot].watched.size(); ++i) {
    dictionary.came_by_rpdo(details[slot].watched[i]);
  }
}

}  // namespace linegate::pdo
