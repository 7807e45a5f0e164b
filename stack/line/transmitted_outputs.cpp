// SPDX-License-Identifier: Apache-2.0
#include "stack/line/transmitted_outputs.h"

#include <algorithm>
#include <utility>

#include "stack/base/assert.h"
#include "stack/line/mpdo_service.h"

namespace linegate::line {

using image::Direction;

void TransmittedOutputs::assign(std::span<const std::uint32_t> entries) {
  LINEGATE_ASSERT(entries.empty() || entries.back() - entries.front() + 1 == entries.size(),
                  "the entries of a device are adjacent");
  const std::vector<image::Entry>& places = image_.layout(Direction::outputs).entries;
  first_ = entries.empty() ? 0 : entries.front();
  outputs_.assign(entries.size(), {});
  objects_.clear();
  for (const std::uint32_t entry : entries) {
    objects_.push_back({{places[entry].index, places[entry].sub}, entry});
  }
  std::ranges::sort(objects_, {}, &Object::address);
  carried_.clear();
  revision_ = 0;
  set_operational(false);
}

void TransmittedOutputs::follow(const pdo::Engine& pdos) {
  if (std::exchange(revision_, pdos.revision()) == pdos.revision()) {
    return;
  }
  const std::vector<Carried> before = std::exchange(carried_, {});
  const std::vector<Output> outputs = std::exchange(outputs_, std::vector<Output>(outputs_.size()));
  const can::CobId cob_id = pdos.scanning_cob_id();
  const bool same_mpdos = std::exchange(scanning_, cob_id) == cob_id;
  for (const Object& object : objects_) {
    const Output& old = outputs[object.entry - first_];
    Output& output = this->output(object.entry);
    output.is_scanned = pdos.scans(object.address);
    const bool was_so = same_mpdos && old.is_scanned;
    output.is_transmitted = output.is_scanned && was_so && old.is_transmitted;
    are_mpdos_new_ = are_mpdos_new_ || (output.is_scanned && !was_so);
  }
  for (const pdo::Engine::SentObject& object : pdos.sent_objects()) {
    const Object* const found = find(object.address);
    if (found == nullptr) {
      continue;
    }
    carried_.push_back({object, found->entry});
    bool was_so = false;
    auto old = std::ranges::lower_bound(before, object.tpdo, {}, &Carried::tpdo);
    for (; old != before.end() && old->tpdo() == object.tpdo; ++old) {
      was_so = was_so || *old == carried_.back();
    }
    Output& output = this->output(found->entry);
    output.is_carried = true;
    output.is_transmitted |= was_so && outputs[found->entry - first_].is_transmitted;
  }
  refresh();
}

const TransmittedOutputs::Object* TransmittedOutputs::find(od::Address address) const {
  const auto found = std::ranges::lower_bound(objects_, address, {}, &Object::address);
  return found != objects_.end() && found->address == address ? &*found : nullptr;
}

void TransmittedOutputs::refresh() {
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    written(entry_of(i));
  }
}

void TransmittedOutputs::changed(std::uint32_t entry) {
  output(entry).is_transmitted = false;
  written(entry);
}

void TransmittedOutputs::written(std::uint32_t entry) {
  const Output& output = this->output(entry);
  const bool is_valid = is_operational_ && !is_bus_lost_ &&
                        image_.is_known(Direction::outputs, entry) &&
                        ((!output.is_carried && !output.is_scanned) || output.is_transmitted);
  image_.set_entry_valid(Direction::outputs, entry, is_valid);
}

void TransmittedOutputs::transmitted(std::uint16_t tpdo, std::span<const std::byte> differs) {
  if (is_bus_lost_) {
    return;
  }
  auto it = std::ranges::lower_bound(carried_, tpdo, {}, &Carried::tpdo);
  for (; it != carried_.end() && it->tpdo() == tpdo; ++it) {
    Output& output = this->output(it->entry);
    if (!output.is_transmitted && !it->object.has_bit(differs)) {
      output.is_transmitted = true;
      written(it->entry);
    }
  }
}

void TransmittedOutputs::transmitted(od::Address source) {
  const Object* const found = find(source);
  if (found != nullptr && !is_bus_lost_ && output(found->entry).is_scanned) {
    output(found->entry).is_transmitted = true;
    written(found->entry);
  }
}

void TransmittedOutputs::request_mpdos(pdo::Engine& pdos, Instant now) {
  are_mpdos_new_ = false;
  for (const Object& object : objects_) {
    const Output& output = this->output(object.entry);
    if (output.is_scanned && !output.is_transmitted &&
        image_.is_known(Direction::outputs, object.entry) && pdos.awaits_trigger(object.address)) {
      pdos.value_changed(object.address, now);
    }
  }
}

void TransmittedOutputs::request_new_mpdos(pdo::Engine& pdos, Instant now) {
  if (are_mpdos_new_ && is_operational_ && !is_bus_lost_) {
    request_mpdos(pdos, now);
  }
}

void TransmittedOutputs::set_operational(bool operational) {
  is_operational_ = operational;
  forget();
}

void TransmittedOutputs::forget() {
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    changed(entry_of(i));
  }
}

void TransmittedOutputs::lose_bus() {
  if (!std::exchange(is_bus_lost_, true)) {
    forget();
  }
}

void TransmittedOutputs::find_bus(pdo::Engine& pdos, Instant now, bool with_mpdos) {
  if (!std::exchange(is_bus_lost_, false)) {
    return;
  }
  refresh();
  if (with_mpdos) {
    request_mpdos(pdos, now);
  }
  std::uint16_t requested = 0;
  for (const Carried& carried : carried_) {
    if (carried.tpdo() != requested) {
      requested = carried.tpdo();
      pdos.trigger(requested, now);
    }
  }
}

void TransmittedOutputs::request(od::Address address, pdo::Engine& pdos, Instant now) const {
  const Object* const found = find(address);
  if (found == nullptr || output(found->entry).is_transmitted ||
      !awaits_trigger(found->entry, pdos)) {
    return;
  }
  if (output(found->entry).is_scanned) {
    pdos.value_changed(address, now);
  }
  for (const Carried& carried : carried_) {
    if (carried.entry == found->entry) {
      pdos.trigger(carried.tpdo(), now);
    }
  }
}

bool TransmittedOutputs::awaits_trigger(std::uint32_t entry, const pdo::Engine& pdos) const {
  const image::Entry& place = image_.layout(Direction::outputs).entries[entry];
  const Output& output = this->output(entry);
  return (output.is_carried || output.is_scanned) &&
         std::ranges::all_of(carried_,
                             [&](const Carried& carried) {
                               return carried.entry != entry || pdos.awaits_trigger(carried.object);
                             }) &&
         (!output.is_scanned || pdos.awaits_trigger(od::Address{place.index, place.sub}));
}

std::vector<FramesUnderWay::Awaited> TransmittedOutputs::frames_of(std::uint32_t entry,
                                                                   const node::Node& node) const {
  std::vector<FramesUnderWay::Awaited> frames;
  for (const Carried& carried : carried_) {
    const std::uint16_t tpdo = carried.tpdo();
    if (carried.entry == entry && (frames.empty() || frames.back().tpdo != tpdo)) {
      frames.push_back({.tpdo = tpdo, .samples = node.pdos().samples(tpdo)});
    }
  }
  if (output(entry).is_scanned) {
    const image::Entry& place = image_.layout(Direction::outputs).entries[entry];
    const std::uint16_t tpdo = node.pdos().scanning_tpdo();
    frames.push_back({.frame = mpdo_frame(node.dictionary(), tpdo, node.node_id(),
                                          od::Address{place.index, place.sub}),
                      .any_value = true,
                      .scanning_tpdo = tpdo});
  }
  return frames;
}

OutputWait TransmittedOutputs::reason_of(std::uint32_t entry, const pdo::Engine& pdos,
                                         bool stuck) const {
  if (is_bus_lost_) {
    return OutputWait::bus;  // find_bus() requests it
  }
  return wait_of_request(awaits_trigger(entry, pdos), stuck);
}

}  // namespace linegate::line
