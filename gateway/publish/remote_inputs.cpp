// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/remote_inputs.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>

#include "gateway/config/value.h"

namespace linegate::gateway {
namespace {

using line::OutputRefusal;

// A former publisher may have sent samples until its end that are received after the first of the
// next one.
constexpr Duration kOverlap = std::chrono::seconds(1);
// A state of the line was lost. Afterwards DDS has kRepair to repeat a newer image.
constexpr Duration kPause = std::chrono::milliseconds(1'500);
constexpr Duration kRepair = std::chrono::seconds(1);
// A write that the line refuses is repeated after this time at the latest.
constexpr Duration kRepetition = std::chrono::seconds(1);

constexpr unsigned kMostRemoteBits = 8 * line::OutputValue::kMaxLength;

// The only entry for which `wanted` is true; nullptr if there is none, or several.
template <class Wanted>
const image::Entry* only_entry(const image::Layout& layout, Wanted wanted) {
  const auto first = std::ranges::find_if(layout.entries, wanted);
  if (first == layout.entries.end() ||
      std::find_if(first + 1, layout.entries.end(), wanted) != layout.entries.end()) {
    return nullptr;
  }
  return &*first;
}

// text: the name of an entry, or NODE.INDEX:SUB.
const image::Entry* find_entry(const image::Layout& layout, const std::string& text) {
  const auto by_name = [&](const image::Entry& entry) { return entry.name == text; };
  if (std::ranges::any_of(layout.entries, by_name)) {
    return only_entry(layout, by_name);
  }
  const std::size_t dot = text.find('.');
  const auto address =
      dot == std::string::npos ? std::nullopt : config::parse_address(text.substr(dot + 1));
  if (!address) {
    return nullptr;
  }
  const std::string node = text.substr(0, dot + 1);
  const auto is_wanted = [&](const image::Entry& entry) {
    return od::Address{entry.index, entry.sub} == *address && entry.name.starts_with(node);
  };
  const auto is_of_pdo = [&](const image::Entry& entry) {
    return is_wanted(entry) && !image::is_srdo(entry.remote_pdo);
  };
  return std::ranges::any_of(layout.entries, is_of_pdo) ? only_entry(layout, is_of_pdo)
                                                        : only_entry(layout, is_wanted);
}

bool has_bit(const std::vector<std::uint64_t>& words, std::size_t i) {
  return i / 64 < words.size() && (words[i / 64] >> (i % 64) & 1U) != 0;
}

// Nothing if the bits are not in the area, or are too many.
std::optional<line::OutputValue> read_value(const std::vector<std::byte>& area,
                                            const image::Entry& entry) {
  const std::uint64_t end = std::uint64_t{entry.bit_offset} + entry.bit_length;
  if (entry.bit_length == 0 || entry.bit_length > kMostRemoteBits ||
      end > std::uint64_t{area.size()} * 8) {
    return std::nullopt;
  }
  line::OutputValue out{.length = static_cast<std::uint8_t>((entry.bit_length + 7U) / 8U)};
  for (std::uint32_t i = 0; i < entry.bit_length; ++i) {
    const std::uint32_t bit = entry.bit_offset + i;
    out.data[i / 8] |= (area[bit / 8] >> bit % 8 & std::byte{1}) << i % 8;
  }
  return out;
}

OutputRefusal verdict_of(const image::Layout& layout, const config::RemoteInput& wanted) {
  const image::Entry* const entry = find_entry(layout, wanted.entry);
  if (entry == nullptr) {
    return OutputRefusal::source_missing;
  }
  const bool same_unit = entry->scaling == od::Scaling{} || wanted.scaling == od::Scaling{} ||
                         entry->scaling == wanted.scaling;
  const bool fits =
      entry->type == wanted.type && entry->bit_length == wanted.bit_length && same_unit;
  return fits ? OutputRefusal::none : OutputRefusal::source_type;
}

// The value of the input if it is valid, of an image that belongs to the layout.
std::optional<line::OutputValue> value_of(const std::optional<image::Layout>& layout,
                                          const std::optional<image::Snapshot>& image,
                                          const config::RemoteInput& wanted) {
  if (!layout || !image || image->layout_id != layout->id ||
      verdict_of(*layout, wanted) != OutputRefusal::none) {
    return std::nullopt;
  }
  const image::Entry& entry = *find_entry(*layout, wanted.entry);
  const auto number = static_cast<std::size_t>(&entry - layout->entries.data());
  return has_bit(image->valid, number) ? read_value(image->bytes, entry) : std::nullopt;
}

// Whether DDS gave the image once more, as to a new reader.
bool is_repeated(const std::optional<image::Snapshot>& known, const image::Snapshot& image) {
  return known && known->layout_id == image.layout_id && known->sequence == image.sequence &&
         known->acquired == image.acquired;
}

}  // namespace

void RemoteInputs::set_rules(std::vector<Rule> rules) {
  std::map<config::RemoteLine, Source> known = std::exchange(sources_, {});
  for (Rule& rule : rules) {
    const config::RemoteLine line = rule.input.from;
    sources_[line].targets.push_back({.rule = std::move(rule)});
  }
  for (auto& [line, source] : sources_) {
    if (const auto before = known.find(line); before != known.end()) {
      source.publishers = std::move(before->second.publishers);
      for (Target& target : source.targets) {
        const auto same = std::ranges::find_if(before->second.targets, [&](const Target& of) {
          return is_same(of.rule, target.rule);
        });
        if (same != before->second.targets.end()) {
          target.had_value = same->had_value;
          target.awaited = same->awaited;
          target.reported = same->reported;
        }
      }
    }
    for (Publisher& publisher : source.publishers) {
      publisher.verdicts.clear();
      doubt(publisher);  // the readers may be new ones
      judge(source, publisher);
    }
  }
}

// Nothing while it is not certain that the image belongs to the layout.
std::optional<line::OutputValue> RemoteInputs::value_in(const Publisher& publisher,
                                                        const config::RemoteInput& input,
                                                        Instant now) {
  return publisher.match.is_certain(now) ? value_of(publisher.layout, publisher.image, input)
                                         : std::nullopt;
}

bool RemoteInputs::is_same(const Rule& a, const Rule& b) {
  return a.line == b.line && a.layout_id == b.layout_id && a.input.entry == b.input.entry &&
         a.input.output == b.input.output;
}

std::vector<config::RemoteLine> RemoteInputs::lines() const {
  std::vector<config::RemoteLine> out;
  for (const auto& [line, source] : sources_) {
    out.push_back(line);
  }
  return out;
}

RemoteInputs::Source* RemoteInputs::find(const config::RemoteLine& line) {
  const auto found = sources_.find(line);
  return found == sources_.end() ? nullptr : &found->second;
}

// The one with that incarnation; nullptr if there are too many. A publisher that is heard keeps its
// place, with its layout, which comes only once.
RemoteInputs::Publisher* RemoteInputs::publisher(Source& source, std::uint64_t incarnation,
                                                 Instant now) {
  std::vector<Publisher>& known = source.publishers;
  if (const auto found = std::ranges::find(known, incarnation, &Publisher::incarnation);
      found != known.end()) {
    return &*found;
  }
  if (known.size() >= kMostPublishers) {
    const auto oldest = std::ranges::min_element(known, {}, &Publisher::heard);
    if (now - oldest->heard < kSilence) {
      return nullptr;
    }
    known.erase(oldest);
  }
  known.push_back({.incarnation = incarnation, .began = now, .heard = now, .resumed = now});
  return &known.back();
}

// A sample of that kind was received. Returns how long the publisher was silent.
Duration RemoteInputs::hear(Publisher& publisher, bool Publisher::*had, Instant now) {
  const Duration silence = now - std::exchange(publisher.heard, now);
  if (silence > kPause) {
    publisher.resumed = now;
  }
  if (silence >= kSilence) {
    doubt(publisher);
  }
  publisher.is_live |= std::exchange(publisher.*had, true);
  return silence;
}

// The next samples may be old ones, which DDS keeps for new readers.
void RemoteInputs::doubt(Publisher& publisher) {
  publisher.had_state = publisher.had_image = publisher.is_live = false;
}

// Whether the values of the publisher count: it is live, it is the last one that began, and earlier
// ones have ended. An earlier one counts again when the later one is silent.
bool RemoteInputs::speaks(Source& source, Publisher& publisher, Instant now) {
  bool disputed = false;
  bool follows_another = false;
  for (const Publisher& other : source.publishers) {
    if (&other == &publisher || now - other.heard >= kSilence) {
      continue;
    }
    if (&other > &publisher) {
      return false;
    }
    follows_another |= now - other.heard < kHandOver;
    disputed |= other.heard > publisher.began + kOverlap;
  }
  if (disputed && !std::exchange(publisher.dispute_reported, true)) {
    for (const Target& target : source.targets) {
      sink_.refuse(target.rule, OutputRefusal::source_disputed);
    }
  }
  publisher.dispute_reported = disputed;
  return publisher.is_live && !disputed && !follows_another;
}

void RemoteInputs::judge(Source& source, Publisher& publisher) {
  if (!publisher.layout) {
    return;
  }
  publisher.verdicts.resize(source.targets.size(), OutputRefusal::none);
  for (std::size_t i = 0; i < source.targets.size(); ++i) {
    const Rule& rule = source.targets[i].rule;
    const OutputRefusal verdict = verdict_of(*publisher.layout, rule.input);
    if (std::exchange(publisher.verdicts[i], verdict) != verdict &&
        verdict != OutputRefusal::none) {
      sink_.refuse(rule, verdict);
    }
  }
}

void RemoteInputs::take_state(const RemoteSource& from, std::int64_t time, Instant now) {
  Source* const source = find(from.line);
  if (source == nullptr) {
    return;
  }
  Publisher* const known = publisher(*source, from.incarnation, now);
  if (known == nullptr || known->state_time == time) {
    return;  // a state that is repeated for late subscribers does not show that the line runs
  }
  Publisher& publisher = *known;
  publisher.state_time = time;
  const Duration silence = hear(publisher, &Publisher::had_state, now);
  if (!speaks(*source, publisher, now) || now - publisher.resumed < kRepair) {
    return;
  }
  for (Target& target : source->targets) {
    if (silence <= target.rule.input.timeout) {
      confirm(target, publisher, now);
    }
  }
}

void RemoteInputs::take_layout(const RemoteSource& from, const image::Layout& layout, Instant now) {
  Source* const source = find(from.line);
  if (source == nullptr || layout.direction != image::Direction::inputs) {
    return;
  }
  Publisher* const known = publisher(*source, from.incarnation, now);
  if (known == nullptr) {
    return;
  }
  Publisher& publisher = *known;
  publisher.match.take(publisher.layout, layout, now);
  publisher.layout = layout;
  judge(*source, publisher);
  // Its image may have been received before. After another layout it does not count yet.
  const bool is_fresh = publisher.image && now - publisher.image_heard < kRepair;
  if (is_fresh && speaks(*source, publisher, now)) {
    for (Target& target : source->targets) {
      confirm(target, publisher, now);
    }
  }
}

void RemoteInputs::take_image(const RemoteSource& from, const image::Snapshot& image, Instant now) {
  Source* const source = find(from.line);
  if (source == nullptr || image.direction != image::Direction::inputs) {
    return;
  }
  Publisher* const known = publisher(*source, from.incarnation, now);
  if (known == nullptr || known->match.is_overtaken(known->image, image, now) ||
      is_repeated(known->image, image)) {
    return;
  }
  Publisher& publisher = *known;
  publisher.match.take(publisher.image, image, now);
  publisher.image = image;
  publisher.image_heard = now;
  hear(publisher, &Publisher::had_image, now);
  if (!speaks(*source, publisher, now)) {
    return;
  }
  for (Target& target : source->targets) {
    confirm(target, publisher, now);
  }
}

void RemoteInputs::confirm(Target& target, const Publisher& publisher, Instant now) {
  const auto value = value_in(publisher, target.rule.input, now);
  if (!value) {
    target.waits_for_room = false;
    return;
  }
  target.confirmed = now;
  target.had_value = true;
  write(target, *value, now);
}

// An unchanged value is repeated when a quarter of the time-out has passed, or kRepetition. Each
// repetition has another arming number: if the watchdog fired before it, it ends the reaction.
void RemoteInputs::write(Target& target, const line::OutputValue& value, Instant now) {
  const config::RemoteInput& input = target.rule.input;
  const bool is_due =
      target.arming == 0 || now - target.written >= std::min(input.timeout / 4, kRepetition);
  if (!is_due && value.data == target.value.data && !target.waits_for_room) {
    return;
  }
  line::OutputWrite write{
      .group = input.group,
      .layout_id = target.rule.layout_id,
      .arming =
          is_due ? static_cast<std::uint64_t>(now.time_since_epoch().count() | 1) : target.arming,
      .watchdog = input.timeout - (now - target.confirmed),
      .reactions = input.reactions,
      .client = input.from.gateway + '/' + input.from.line,
      .forwarded = true};
  write.values.push_back(value);
  write.values.back().entry = input.output;
  target.value = value;
  target.waits_for_room = !sink_.write(target.rule.line, write);
  if (!target.waits_for_room) {
    target.written = now;
    target.arming = write.arming;
  }
}

void RemoteInputs::advance(Instant now) {
  for (auto& [line, source] : sources_) {
    for (Target& target : source.targets) {
      if (target.waits_for_room) {
        retry(source, target, now);
      }
      report_absent(source, target, now);
    }
  }
}

// A source that was lost is reported by the watchdog of the group, which the first value arms.
void RemoteInputs::report_absent(const Source& source, Target& target, Instant now) {
  if (!target.awaited) {
    target.awaited = now;
  }
  if (target.had_value || target.reported == OutputRefusal::source_invalid ||
      now - *target.awaited < target.rule.input.timeout + kSilence) {
    return;
  }
  const OutputRefusal why = why_absent(source, target, now);
  if (why != OutputRefusal::none && std::exchange(target.reported, why) != why) {
    sink_.refuse(target.rule, why);
  }
}

// none: it may come yet, or judge() or speaks() have reported the reason.
OutputRefusal RemoteInputs::why_absent(const Source& source, const Target& target, Instant now) {
  OutputRefusal out = OutputRefusal::source_silent;
  for (const Publisher& publisher : source.publishers) {
    if (now - publisher.heard >= kSilence) {
      continue;
    }
    if (now - publisher.began < kSilence || publisher.dispute_reported ||
        (publisher.layout &&
         verdict_of(*publisher.layout, target.rule.input) != OutputRefusal::none)) {
      return OutputRefusal::none;
    }
    const bool is_complete = publisher.is_live && publisher.layout && publisher.image &&
                             publisher.image->layout_id == publisher.layout->id;
    if (is_complete && !publisher.match.is_certain(now)) {
      return OutputRefusal::none;
    }
    if (is_complete && !value_of(publisher.layout, publisher.image, target.rule.input)) {
      out = OutputRefusal::source_invalid;
    } else if (is_complete) {
      return OutputRefusal::none;
    }
  }
  return out;
}

// Only if the value would be written now, too.
void RemoteInputs::retry(Source& source, Target& target, Instant now) {
  target.waits_for_room = false;
  if (now - target.confirmed >= target.rule.input.timeout) {
    return;
  }
  for (Publisher& publisher : source.publishers) {
    const auto value = value_in(publisher, target.rule.input, now);
    if (value && speaks(source, publisher, now)) {
      target.arming = 0;
      return write(target, *value, now);
    }
  }
}

}  // namespace linegate::gateway
