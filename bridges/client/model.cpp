// SPDX-License-Identifier: Apache-2.0
#include "bridges/client/model.h"

#include <algorithm>
#include <span>

#include "bridges/client/values.h"

namespace linegate::client {
namespace {

constexpr std::string_view kInputs = "inputs:";
constexpr std::string_view kOutputs = "outputs:";

bool bit_at(const std::vector<std::uint64_t>& words, std::size_t i) {
  return i / 64 < words.size() && (words[i / 64] >> (i % 64) & 1U) != 0;
}

Value without_data(const std::string& name, Quality quality) {
  Value value;
  value.name = name;
  value.quality = quality;
  return value;
}

}  // namespace

void Area::take(const image::Layout& from, std::uint64_t incarnation, Instant now) {
  const bool same_places =
      layout && layout->id == from.id && has_layout(incarnation);  // other names, perhaps
  match.take(has_layout(incarnation) ? layout : std::nullopt, from, now);
  layout = from;
  layout_incarnation = incarnation;
  entries.clear();
  for (std::uint32_t i = 0; i < from.entries.size(); ++i)
    entries.try_emplace(from.entries[i].name, i);
  if (!same_places || received.size() != from.entries.size())
    received.assign(from.entries.size(), Instant{});
}

void Area::take(const image::Snapshot& from, std::uint64_t incarnation, Instant now) {
  const bool same_start = image_incarnation == incarnation;
  if (same_start && match.is_overtaken(image, from, now))
    return;
  match.take(same_start ? image : std::nullopt, from, now);
  if (image && image_incarnation == incarnation && from.sequence > image->sequence + 1)
    lost += from.sequence - image->sequence - 1;
  image = from;
  image_incarnation = incarnation;
  if (!layout || layout->id != from.layout_id)
    return;
  for (const image::PdoMark& mark : from.marks) {
    const std::uint64_t end =
        std::min<std::uint64_t>(std::uint64_t{mark.first_entry} + mark.entries, received.size());
    for (std::uint64_t entry = mark.first_entry; entry < end; ++entry)
      received[entry] = mark.time;
  }
}

bool Area::complete(std::uint64_t incarnation, Instant now) const {
  return has_layout(incarnation) && image && image_incarnation == incarnation &&
         layout->id == image->layout_id && match.is_certain(now);
}

bool LineData::follow(std::uint64_t other, Instant now) {
  if (seen && other == incarnation)
    return true;
  const bool returns = is_former(other);
  if (returns && !gone && now - heard < kSilence)
    return false;
  follow_areas(other);
  const auto is_of_another = [&](const auto& state) { return state.second.incarnation != other; };
  if (returns) {
    std::swap(nodes, former_nodes);
  } else if (seen) {
    former_nodes = nodes;
    std::erase_if(nodes, is_of_another);  // those of the new start may come before its LineState
  }
  std::erase_if(groups, is_of_another);
  former = incarnation;
  incarnation = other;
  return true;
}

void LineData::follow_areas(std::uint64_t other) {
  for (std::size_t i = 0; i < areas.size(); ++i) {
    Area& kept = former_areas[i];
    if (areas[i].has_layout(other))
      continue;
    if (!kept.has_layout(other)) {
      if (areas[i].has_layout(incarnation))
        kept = areas[i];
      continue;
    }
    std::swap(areas[i], kept);
    areas[i].lost = std::max(areas[i].lost, kept.lost);  // it never decreases
    ++layout_revision;
    ++outputs_revision;
  }
}

Area& LineData::area_of(image::Direction direction, std::uint64_t other) {
  Area& present = area(direction);
  Area& kept = former_areas[static_cast<std::size_t>(direction)];
  if (is_former(other) || (!seen && kept.has_layout(other)))
    return kept;
  const bool is_whole = present.layout && present.layout_incarnation != other &&
                        (!present.image || present.image_incarnation == present.layout_incarnation);
  if (is_whole && (!seen || present.layout_incarnation == incarnation))
    kept = present;
  return present;
}

LineStatus LineData::status(Instant now) const {
  if (!seen)
    return LineStatus::waiting;
  if (gone)
    return LineStatus::lost;
  if (now - heard > kSilence)
    return LineStatus::silent;
  if (has_namesake)
    return LineStatus::ambiguous;
  for (const Area& one : areas) {
    const bool empty = one.has_layout(incarnation) && one.layout->entries.empty();
    if (!empty && !one.complete(incarnation, now))
      return LineStatus::waiting;
  }
  return LineStatus::ready;
}

Value LineData::value_of(const Area& area, std::uint32_t number) const {
  const image::Entry& entry = area.layout->entries[number];
  const bool is_output = area.layout->direction == image::Direction::outputs;
  Value value;
  value.name = entry.name;
  const bool valid = bit_at(area.image->valid, number);
  value.known = is_output ? bit_at(area.image->known, number) : valid;
  value.time = area.received[number].time_since_epoch().count();
  const auto bits = bits_of(area.image->bytes, entry.bit_offset, entry.bit_length);
  // Before the first value the image has zeros, which are no value.
  if (valid || value.known || value.time != 0) {
    value.raw = decode(entry.type, entry.bit_length, bits);
    value.data = scaled(entry, value.raw, bits);
  }
  if (valid && value.data.index() != 0) {
    value.quality = Quality::good;
  } else if (is_output) {
    value.quality = Quality::not_sent;
  } else {
    const auto node = nodes.find(entry.node);
    const bool missing = node != nodes.end() && node->second.incarnation == incarnation &&
                         node->second.presence == line::Presence::missing;
    value.quality = missing ? Quality::node_missing : Quality::not_received;
  }
  return value;
}

Value LineData::read(const std::string& name, Quality line_quality, Instant now) const {
  std::string_view plain = name;
  std::size_t first = 0;
  std::size_t last = 1;
  if (name.starts_with(kInputs)) {
    plain.remove_prefix(kInputs.size());
    last = 0;
  } else if (name.starts_with(kOutputs)) {
    plain.remove_prefix(kOutputs.size());
    first = 1;
  }
  bool layouts = true;
  const std::string key(plain);
  // A name without a direction is that of an output only if no input has it: without the layout of
  // the inputs that is not known.
  for (std::size_t direction = first; direction <= last; ++direction) {
    const Area& one = areas[direction];
    if (!one.layout || (line_quality == Quality::good && !one.has_layout(incarnation))) {
      layouts = false;
      break;
    }
    const auto found = one.entries.find(key);
    if (found == one.entries.end())
      continue;
    // Of a lost gateway the last data are shown, with a quality that says so.
    const bool readable = one.image && one.image->layout_id == one.layout->id &&
                          one.image_incarnation == one.layout_incarnation &&
                          one.match.is_certain(now);
    Value value = readable ? value_of(one, found->second)
                           : without_data(name, line_quality == Quality::good ? Quality::no_data
                                                                              : line_quality);
    value.name = name;
    value.unit = one.layout->entries[found->second].scaling.unit;
    if (line_quality != Quality::good)
      value.quality = line_quality;
    return value;
  }
  if (line_quality != Quality::good)
    return without_data(name, line_quality);
  return without_data(name, layouts ? Quality::no_name : Quality::no_data);
}

LineData* Model::find_or_add(const std::string& gateway, const std::string& line) {
  const std::pair key{gateway, line};
  const auto found = lines_.find(key);
  if (found != lines_.end())
    return &found->second;
  if (lines_.size() >= kMaxLines)
    return nullptr;
  LineData& added = lines_[key];
  added.gateway = gateway;
  added.line = line;
  return &added;
}

Model::Found Model::find(const std::string& gateway, const std::string& line) const {
  if (!gateway.empty()) {
    const auto found = lines_.find({gateway, line});
    return {found == lines_.end() || !found->second.seen ? nullptr : &found->second};
  }
  Found live;
  Found gone;
  for (const auto& [key, one] : lines_) {
    if (key.second != line || !one.seen)
      continue;
    Found& found = one.gone ? gone : live;
    found.ambiguous = found.line != nullptr;
    if (found.ambiguous)
      break;
    found.line = &one;
  }
  return live.line != nullptr ? live : gone;
}

}  // namespace linegate::client
