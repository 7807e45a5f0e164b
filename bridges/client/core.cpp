// SPDX-License-Identifier: Apache-2.0
#include "bridges/client/core.h"

#include <algorithm>
#include <charconv>
#include <utility>

#include "bridges/client/values.h"

namespace linegate::client {
namespace {

constexpr linegate::Duration kLongestStep = std::chrono::milliseconds(500);
// A client that was discovered first may not be the last one.
constexpr linegate::Duration kUnchanged = std::chrono::milliseconds(300);
constexpr std::size_t kMaxGateways = 4096;
constexpr std::size_t kMostDue = 65'536;  // call-backs of events that wait

Quality quality_of(LineStatus status) {
  switch (status) {
    case LineStatus::waiting:
    case LineStatus::ready:
      return Quality::good;
    case LineStatus::silent:
      return Quality::gateway_silent;
    case LineStatus::lost:
      return Quality::gateway_lost;
    case LineStatus::ambiguous:
      return Quality::ambiguous;
  }
  return Quality::no_line;
}

}  // namespace

std::optional<std::uint16_t> group_number(const LineData& line, std::string_view name) {
  if (name.empty())
    return 0;
  const LineData::Group* newest = nullptr;
  for (const auto& [number, group] : line.groups) {
    // A reload may have given the name to another one.
    if (line.is_present(&group) && group.state.name == name &&
        (newest == nullptr || group.heard > newest->heard))
      newest = &group;
  }
  if (newest != nullptr)
    return newest->state.group;
  std::uint16_t number = 0;
  const auto [end, failed] = std::from_chars(name.data(), name.data() + name.size(), number);
  if (failed != std::errc{} || end != name.data() + name.size())
    return std::nullopt;
  return number;
}

Core::Core(std::unique_ptr<Link> the_link, std::string the_error)
    : link(std::move(the_link)), error(std::move(the_error)) {
  if (link)
    name = link->name();
}

std::shared_ptr<Core> make_core(std::unique_ptr<Link> link, std::string error) {
  return std::make_shared<Core>(std::move(link), std::move(error));
}

void Core::close() {
  for (const auto& group : groups) {
    if (const auto one = group.lock())
      set_state(*one, GroupState::idle, LossReason::none);
  }
  for (const auto& call : std::exchange(calls, {}))
    finish(call, Outcome::refused, static_cast<std::uint32_t>(line::Refusal::cancelled),
           "the client has ended");
  due.clear();
  link.reset();
  error = "the client has ended";
}

// --- receiving -----------------------------------------------------------------------------------

bool Core::settled() const {
  const dds::Peers peers = link->peers();
  if (peers.unchanged < kUnchanged)
    return false;
  std::map<std::string, std::pair<std::uint64_t, std::uint64_t>> lines;  // received, announced
  for (const auto& [key, one] : model.lines()) {
    if (one.seen && !one.gone) {
      auto& [have, announced] = lines[key.first];
      ++have;
      announced = std::max(announced, one.gateway_lines);
    }
  }
  return std::ranges::all_of(peers.gateways, [&](const std::string& gateway) {
    const auto found = lines.find(gateway);
    return found != lines.end() && found->second.first >= found->second.second;
  });
}

Model::Found Core::find(const std::string& gateway, const std::string& line) const {
  if (!link)
    return {};
  const Model::Found found = model.find(gateway, line);
  return gateway.empty() && !was_settled ? Model::Found{} : found;
}

LineStatus Core::status(const std::string& gateway, const std::string& line) const {
  if (!link)
    return LineStatus::lost;
  const Model::Found found = find(gateway, line);
  if (found.ambiguous)
    return LineStatus::ambiguous;
  return found.line == nullptr ? LineStatus::waiting : found.line->status(link->now());
}

Snapshot Core::read(const std::string& gateway, const std::string& line,
                    const std::vector<std::string>& names) const {
  Snapshot out;
  const Model::Found found = find(gateway, line);
  Quality quality = Quality::no_line;
  if (found.ambiguous)
    quality = Quality::ambiguous;
  else if (found.line != nullptr)
    quality = quality_of(found.line->status(link->now()));
  else if (!link)
    quality = Quality::gateway_lost;
  const bool readable = found.line != nullptr && !found.ambiguous;
  out.values.reserve(names.size());
  for (const std::string& one : names) {
    if (readable) {
      out.values.push_back(found.line->read(one, quality, link->now()));
    } else {
      out.values.emplace_back().name = one;
      out.values.back().quality = quality;
    }
  }
  if (readable) {
    for (const Area& area : found.line->areas) {
      if (area.image && area.image->acquired.time_since_epoch().count() > out.time) {
        out.time = area.image->acquired.time_since_epoch().count();
        out.sequence = area.image->sequence;
      }
    }
  }
  return out;
}

LineData* Core::sample_of(const dds::Source& source) {
  received = true;
  LineData* const line = model.find_or_add(source.gateway, source.line);
  if (line != nullptr)
    ++line->revision;
  return line;
}

void Core::on_gateway(const dds::Source& source, const dds::GatewayInfo& info) {
  received = true;
  if (gateway_events.size() < kMaxGateways)
    gateway_events.try_emplace(source.gateway, FirstEvents{source.incarnation, info.events});
  newest_events.note_gateway(source, info);
  for (const auto& one : followings())
    one->following->receive_gateway(source, info, link->now());
}

void Core::on_line(const dds::Source& source, const dds::LineInfo& /*info*/,
                   const line::LineState& state, const std::vector<dds::Property>& properties) {
  newest_events.note_line(source, state.counters.events);
  for (const auto& one : followings())
    one->following->receive_line(source, state.counters.events, link->now());
  LineData* const line = sample_of(source);
  if (line == nullptr)
    return;
  if (!line->seen) {
    line->events_before = state.counters.events;
    line->events_incarnation = source.incarnation;
  }
  const bool is_known = line->seen && line->incarnation == source.incarnation;
  if (!line->follow(source.incarnation, link->now()))
    return;
  // After a silence, too: the states of its groups come on another topic.
  if (!is_known || line->gone || link->now() - line->heard >= kSilence)
    line->begun = link->now();
  line->seen = true;
  line->gone = false;
  line->heard = link->now();
  line->has_namesake =
      std::ranges::find(properties, "namesakes", &dds::Property::name) != properties.end();
  for (const dds::Property& property : properties) {
    const char* const end = property.value.data() + property.value.size();
    std::uint64_t lines = 0;
    if (property.name == "lines" && std::from_chars(property.value.data(), end, lines).ptr == end)
      line->gateway_lines = lines;
  }
}

void Core::on_node(const dds::Source& source, const dds::NodeInfo& /*info*/,
                   const line::NodeState& state, const std::vector<dds::Property>& /*of*/) {
  LineData* const line = sample_of(source);
  if (line == nullptr)
    return;
  auto& nodes = line->is_former(source.incarnation) ? line->former_nodes : line->nodes;
  nodes[state.node] = {state.presence, source.incarnation};
}

void Core::on_output_state(const dds::Source& source, const line::OutputState& state) {
  LineData* const line = sample_of(source);
  if (line != nullptr && line->groups.size() < 65'536 && !line->is_former(source.incarnation))
    line->groups[state.group] = {state, source.incarnation, link->now()};
}

void Core::on_layout(const dds::Source& source, const image::Layout& layout) {
  LineData* const line = sample_of(source);
  if (line == nullptr)
    return;
  // The layout of a restarted gateway may arrive before its LineState, and one of before it late.
  Area& area = line->area_of(layout.direction, source.incarnation);
  if (line->is_former(source.incarnation))
    return area.take(layout, source.incarnation, link->now());
  const bool same = area.layout && area.layout->id == layout.id &&
                    std::ranges::equal(area.layout->entries, layout.entries, {},
                                       &image::Entry::name, &image::Entry::name);
  if (!same)
    ++line->layout_revision;
  // With other names the values of a group would go to outputs that the application does not mean.
  if (!same && area.layout && layout.direction == image::Direction::outputs)
    ++line->outputs_revision;
  area.take(layout, source.incarnation, link->now());
}

void Core::on_image(const dds::Source& source, const image::Snapshot& image) {
  LineData* const line = sample_of(source);
  if (line == nullptr)
    return;
  line->area_of(image.direction, source.incarnation).take(image, source.incarnation, link->now());
}

void Core::on_line_gone(std::string_view gateway, std::string_view line) {
  received = true;
  const auto found = model.lines().find({std::string(gateway), std::string(line)});
  if (found == model.lines().end())
    return;
  found->second.gone = true;
  ++found->second.revision;
}

void Core::on_node_gone(std::string_view gateway, std::string_view line, std::uint8_t node) {
  received = true;
  const auto found = model.lines().find({std::string(gateway), std::string(line)});
  if (found != model.lines().end() && found->second.nodes.erase(node) != 0)
    ++found->second.revision;
}

// A reload has removed the group. One that is held is lost, see service_group().
void Core::on_output_state_gone(std::string_view gateway, std::string_view line,
                                std::uint16_t group) {
  received = true;
  const auto found = model.lines().find({std::string(gateway), std::string(line)});
  if (found != model.lines().end() && found->second.groups.erase(group) != 0)
    ++found->second.revision;
}

// Late joiners receive past events, too.
bool Core::is_new(const dds::Source& source, std::uint64_t number) {
  if (source.line.empty()) {
    const auto found = gateway_events.find(source.gateway);
    return found != gateway_events.end() &&
           (source.incarnation != found->second.incarnation || number > found->second.number);
  }
  const LineData* const line = sample_of(source);
  if (line == nullptr || !line->seen)
    return false;
  return source.incarnation != line->events_incarnation || number > line->events_before;
}

void Core::on_event(const dds::Source& source, const dds::ReceivedEvent& event,
                    std::string_view text, const std::vector<dds::Property>& /*properties*/) {
  received = true;
  newest_events.note_event(source, event);
  for (const auto& one : followings())
    one->following->take({source, event, std::string(text), {}}, link->now());
  if (!is_new(source, event.number))
    return;
  note_progress(source, event);
  for (const auto& one : live(subscriptions)) {
    if (!one->on_event || one->following || due.size() >= kMostDue)
      continue;
    due.emplace_back([weak = std::weak_ptr(one), out = event_of(source, event, text)] {
      if (const auto subscription = lock(weak))
        subscription->on_event(out);
    });
  }
}

// --- polling -------------------------------------------------------------------------------------

std::vector<std::shared_ptr<SubscriptionData>> Core::live(
    std::vector<std::weak_ptr<SubscriptionData>>& list) {
  std::vector<std::shared_ptr<SubscriptionData>> out;
  std::erase_if(list, [](const auto& one) { return one.expired(); });
  for (const auto& one : list) {
    if (auto subscription = lock(one))
      out.push_back(std::move(subscription));
  }
  return out;
}

std::shared_ptr<SubscriptionData> Core::lock(const std::weak_ptr<SubscriptionData>& weak) {
  auto out = weak.lock();
  return out && !out->ended ? out : nullptr;
}

// A call-back that runs holds the data, so that it may end its own subscription.
std::shared_ptr<SubscriptionData> Core::owned(std::shared_ptr<SubscriptionData> data) {
  SubscriptionData* const plain = data.get();
  return {plain, [data = std::move(data)](SubscriptionData* it) mutable {
            it->ended = true;
            data.reset();
          }};
}

bool Core::step(linegate::Duration timeout) {
  const Instant begin = link->now();
  const linegate::Duration slice = std::max(
      linegate::Duration::zero(),
      std::min({timeout, kLongestStep, next_wake() == kNever ? timeout : next_wake() - begin}));
  received = false;
  link->poll(due.empty() ? slice : linegate::Duration::zero(), *this);
  service();
  // What a call-back causes is due in the next step: one may cause the next without end.
  bool called = false;
  for (std::size_t left = due.size(); left > 0 && !due.empty() && link; --left) {
    const auto call_back = std::move(due.front());
    due.pop_front();
    called = true;
    call_back();  // may poll, subscribe or end the client
  }
  // An early return without samples is a wake-up.
  return called || received || !link || link->now() - begin < slice;
}

bool Core::poll(linegate::Duration timeout) {
  if (!link)
    return false;
  const std::shared_ptr<Core> self = shared_from_this();  // a call-back may destroy the client
  const Instant begin = link->now();
  const linegate::Duration most =
      std::clamp<linegate::Duration>(timeout, linegate::Duration::zero(), std::chrono::hours(1));
  while (link) {
    const linegate::Duration left = most - (link->now() - begin);
    if (step(std::max(left, linegate::Duration::zero())) || left <= linegate::Duration::zero())
      break;
  }
  return link != nullptr;
}

Instant Core::next_wake() const {
  Instant next = kNever;
  for (const auto& group : groups) {
    const auto one = group.lock();
    if (one && (one->state == GroupState::taking || one->state == GroupState::held))
      next = earlier(next, one->dirty ? link->now() : one->write_at);
  }
  for (const auto& call : calls) {
    if (call->id == 0)  // else the link wakes at its time-out
      next = earlier(next, call->deadline);
  }
  for (const auto& weak : subscriptions) {
    const auto one = lock(weak);
    if (one && one->following)
      next = earlier(next, one->following->next_wake());
  }
  return next;
}

void Core::service() {
  was_settled = was_settled || settled();
  report_lines();
  follow_events();
  service_groups();
  service_calls();
  report_values();
}

void Core::report_lines() {
  const Instant now = link->now();
  for (auto& [key, line] : model.lines()) {
    if (!line.seen)
      continue;
    const LineStatus status = line.status(now);
    const Change change{
        line.gateway, line.line, status,
        line.incarnation_reported != 0 && line.incarnation_reported != line.incarnation,
        line.incarnation_reported != 0 && line.layout_reported != 0 &&
            line.layout_reported != line.layout_revision && status == LineStatus::ready};
    if (line.reported != status)
      ++line.revision;
    // While it is not ready again, only a part of a new layout may have been received.
    const bool changed = line.reported != status || change.restarted || change.layout_changed;
    report_line(line, change);
    if (!changed)
      continue;
    line.reported = status;
    line.incarnation_reported = line.incarnation;
    if (status == LineStatus::ready)
      line.layout_reported = line.layout_revision;
  }
}

void Core::report_line(LineData& line, const Change& change) {
  const bool changed = line.reported != change.status || change.restarted || change.layout_changed;
  for (const auto& one : live(subscriptions)) {
    if (!one->on_line)
      continue;
    const bool first = one->reported.emplace(line.gateway, line.line).second;
    if (first || changed) {
      due.emplace_back([weak = std::weak_ptr(one), change] {
        if (const auto subscription = lock(weak))
          subscription->on_line(change);
      });
    }
  }
}

std::vector<std::shared_ptr<SubscriptionData>> Core::followings() {
  auto out = live(subscriptions);
  std::erase_if(out, [](const auto& one) { return !one->following; });
  return out;
}

void Core::follow_events() {
  for (const auto& one : followings()) {
    one->following->ask(*link);
    for (Event event; due.size() < kMostDue && one->following->pop(event);) {
      due.emplace_back([weak = std::weak_ptr(one), event = std::move(event)] {
        const auto subscription = lock(weak);
        if (!subscription)
          return;
        subscription->following->pass(event);
        subscription->on_event(event);
      });
    }
  }
}

EventReader Core::follow(std::unique_ptr<EventFollowing> following,
                         std::function<void(const Event&)> call_back) {
  const auto data = std::make_shared<SubscriptionData>();
  data->following = std::move(following);
  if (link)
    data->following->receive(newest_events, link->now());
  data->on_event = std::move(call_back);
  subscriptions.push_back(data);
  EventReader out;
  out.data_ = owned(data);
  return out;
}

void Core::report_values() {
  for (const auto& one : live(subscriptions)) {
    if (one->on_values)
      compare(one);
  }
}

void Core::compare(const std::shared_ptr<SubscriptionData>& subscription) {
  const Model::Found found = find(subscription->gateway, subscription->line);
  const void* const line = found.ambiguous ? nullptr : found.line;
  const std::uint64_t revision = line == nullptr ? 0 : found.line->revision;
  if (subscription->begun && subscription->compared == line && subscription->revision == revision &&
      subscription->ambiguous == found.ambiguous)
    return;
  subscription->ambiguous = found.ambiguous;
  subscription->compared = line;
  subscription->revision = revision;
  Snapshot now = read(subscription->gateway, subscription->line, subscription->names);
  std::vector<std::pair<Data, Quality>> values;
  for (const Value& value : now.values)
    values.emplace_back(value.data, value.quality);
  const auto unchanged = [](const auto& a, const auto& b) {
    return a.second == b.second && is_same(a.first, b.first);
  };
  if (subscription->begun && std::ranges::equal(values, subscription->last, unchanged))
    return;
  std::uint64_t lost = 0;
  if (line != nullptr) {
    for (const Area& area : found.line->areas)
      lost += area.lost;
  }
  now.lost = subscription->begun && lost >= subscription->lost ? lost - subscription->lost : 0;
  subscription->lost = lost;
  subscription->begun = true;
  subscription->last = std::move(values);
  due.emplace_back([weak = std::weak_ptr(subscription), now = std::move(now)] {
    if (const auto one = lock(weak))
      one->on_values(now);
  });
}

Subscription Core::handle(std::shared_ptr<SubscriptionData> data) {
  Subscription out;
  out.data_ = owned(std::move(data));
  return out;
}

Subscription Core::subscribe(SubscriptionData data) {
  auto shared = std::make_shared<SubscriptionData>(std::move(data));
  subscriptions.push_back(shared);
  return handle(std::move(shared));
}

}  // namespace linegate::client
