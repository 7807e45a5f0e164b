// SPDX-License-Identifier: Apache-2.0
#include "stack/line/following.h"

#include <algorithm>
#include <utility>

namespace linegate::line {
namespace {

// Object addresses are the same in every layout, entry numbers are not.
template <class Elements, class Same>
std::uint32_t place_of_object(const Elements& elements, std::uint32_t none, Same same) {
  const auto found = std::ranges::find_if(elements, same);
  return found == elements.end() ? none : static_cast<std::uint32_t>(found - elements.begin());
}

// Whether the entry may show the object: an SRDO never takes the place of a PDO, or a PDO that of
// an SRDO, whose values are valid under other conditions.
bool shows(const image::Entry& entry, const Following::Object& wanted) {
  return entry.node == wanted.node && entry.index == wanted.address.index &&
         entry.sub == wanted.address.sub &&
         (wanted.pdo == 0 || image::is_srdo(entry.remote_pdo) == image::is_srdo(wanted.pdo));
}

// That of the PDO; if another PDO maps the object meanwhile, as an observer may see it, that one.
std::uint32_t entry_of(const std::vector<image::Entry>& entries, std::uint32_t none,
                       const Following::Object& wanted) {
  const std::uint32_t same = place_of_object(entries, none, [&](const image::Entry& entry) {
    return shows(entry, wanted) && entry.remote_pdo == wanted.pdo;
  });
  if (same != none || image::is_srdo(wanted.pdo)) {
    return same;
  }
  return place_of_object(entries, none,
                         [&](const image::Entry& entry) { return shows(entry, wanted); });
}

}  // namespace

std::string_view name(WhenLost when_lost) {
  switch (when_lost) {
    case WhenLost::hold:
      return "hold";
    case WhenLost::zero:
      return "zero";
    case WhenLost::stop:
      break;
  }
  return "stop";
}

void add_parts(Following following, std::uint32_t bits, std::vector<Following>& to) {
  following.input_bits = bits;
  for (following.part = 0; following.part < image::value_parts(bits); ++following.part) {
    to.push_back(following);
  }
}

FollowedInputs::FollowedInputs(std::span<const Following> what)
    : what_(what.begin(), what.end()), entries_(what.size(), kNone), values_(what.size()) {
}

void FollowedInputs::find_entries(const Line& line) {
  const auto& entries = line.layout(image::Direction::inputs).entries;
  const auto& objects = line.config().forwarding.objects;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const Following::Object& wanted = what_[i].input;
    if (wanted.node == 0) {
      entries_[i] = place_of_object(objects, kNone, [&](const routing::ForwardedObject& object) {
        return object.address == wanted.address;
      });
      entries_[i] |= Line::kForwarded;
    } else {
      entries_[i] = entry_of(entries, kNone, wanted);
      // That of an observer may have another length than in the device file. No part of it is used:
      // the others would keep their value.
      if (entries_[i] != kNone && what_[i].input_bits != 0 &&
          entries[entries_[i]].bit_length != what_[i].input_bits) {
        entries_[i] = kNone;
      }
    }
  }
}

[[gnu::hot]] bool FollowedInputs::look(const Line& line) {
  if (std::exchange(revision_, line.layout_revision()) != line.layout_revision() ||
      std::exchange(first_, false)) {
    find_entries(line);
  }
  bool changed = false;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    Line::Input& last = values_[i];
    if (entries_[i] == kNone) [[unlikely]] {
      changed |= std::exchange(last.valid, false);
      continue;
    }
    const Line::Input next = line.input(entries_[i], what_[i].part);
    changed = changed || next.value != last.value || next.valid != last.valid ||
              (what_[i].forwarded && (next.received != last.received || next.late != last.late));
    last = next;
  }
  return changed;
}

FollowingOutputs::FollowingOutputs(std::span<const Following> what)
    : what_(what.begin(), what.end()), written_(what.size()) {
  changed_.reserve(what.size());
}

[[gnu::hot]] bool FollowingOutputs::take(Line& line, std::span<const Line::Input> values,
                                         Instant now) {
  changed_.clear();
  for (std::size_t i = 0; i < values.size(); ++i) {
    consider(what_[i], values[i], written_[i]);
  }
  if (!changed_.empty()) {
    line.write_bound(changed_, now);
  }
  return !changed_.empty();
}

[[gnu::hot]] void FollowingOutputs::consider(const Following& following, const Line::Input& input,
                                             Written& written) {
  const bool lost = !input.valid || (following.forwarded && input.late);
  if (lost && !written.any) {
    return;
  }
  const bool again = following.forwarded && !lost && input.received != written.received;
  const bool valid = !lost || following.when_lost != WhenLost::stop;
  const bool zero = lost && following.when_lost == WhenLost::zero;
  const std::uint64_t value = zero ? 0 : lost && following.forwarded ? written.value : input.value;
  if (written.any && !again && written.value == value && written.valid == valid) {
    return;
  }
  written = {.value = value,
             .received = lost ? written.received : input.received,
             .any = true,
             .valid = valid};
  changed_.push_back({following.output_entry, value, again, valid, input.pdo, following.part});
}

}  // namespace linegate::line
