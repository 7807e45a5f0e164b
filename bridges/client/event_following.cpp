// SPDX-License-Identifier: Apache-2.0
#include "bridges/client/event_following.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <span>
#include <variant>

#include "stack/base/events.h"

namespace linegate::client {
namespace {

constexpr linegate::Duration kPageTimeout = std::chrono::seconds(10);
constexpr std::size_t kMostLines = dds::EventFollower::kMostLines;

bool is_plain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
         std::string_view("_.-~").find(c) != std::string_view::npos;
}

// As in a URL, so that a name contains no separator.
void append_name(std::string& to, std::string_view name) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  for (const char c : name) {
    if (is_plain(c)) {
      to += c;
      continue;
    }
    const auto byte = static_cast<std::uint8_t>(c);
    to += '%';
    to += kDigits[byte >> 4U];
    to += kDigits[byte & 0xFU];
  }
}

bool parse_name(std::string_view text, std::string& name) {
  for (; !text.empty(); text.remove_prefix(1)) {
    if (text.front() != '%') {
      if (!is_plain(text.front()))
        return false;
      name += text.front();
      continue;
    }
    std::uint8_t byte = 0;
    const std::string_view digits = text.substr(1, 2);
    const auto [end, failed] =
        std::from_chars(digits.data(), digits.data() + digits.size(), byte, 16);
    if (failed != std::errc{} || digits.size() != 2 || end != digits.data() + 2)
      return false;
    name += static_cast<char>(byte);
    text.remove_prefix(2);
  }
  return true;
}

// The text before the separator, which is removed with it. Without one: all of it.
std::string_view take_part(std::string_view& text, char separator) {
  const std::size_t end = std::min(text.find(separator), text.size());
  const std::string_view out = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return out;
}

bool parse_number(std::string_view text, std::uint64_t& number) {
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), number);
  return failed == std::errc{} && end == text.data() + text.size();
}

}  // namespace

Event event_of(const dds::Source& source, const dds::ReceivedEvent& event, std::string_view text) {
  const std::span<const std::byte> bytes = event.fields.bytes();
  return {.gateway = source.gateway,
          .line = source.line,
          .number = event.number,
          .stream = event.stream,
          .time = event.time.time_since_epoch().count(),
          .kind = static_cast<std::uint8_t>(event.kind),
          .severity = static_cast<std::uint8_t>(event.severity),
          .node = event.node,
          .code = event.fields.code,
          .value = event.fields.value,
          .data = {bytes.begin(), bytes.end()},
          .name = event.data ? std::string(linegate::name(event.kind)) : "",
          .text = std::string(text)};
}

void NewestEvents::note_gateway(const dds::Source& source, const dds::GatewayInfo& info) {
  if (gateways.size() >= kMostLines && !gateways.contains(source.gateway))
    return;
  gateways[source.gateway] = {source.incarnation, info.event_stream};
  note_line({.gateway = source.gateway}, info.events);
}

void NewestEvents::note_line(const dds::Source& source, std::uint64_t newest) {
  if (lines.size() < 2 * kMostLines || lines.contains({source.gateway, source.line}))
    lines[{source.gateway, source.line}] = newest;
}

void NewestEvents::note_event(const dds::Source& source, const dds::ReceivedEvent& event) {
  const auto gateway = gateways.find(source.gateway);
  const auto line = lines.find({source.gateway, source.line});
  if (gateway != gateways.end() && gateway->second.stream == event.stream && line != lines.end())
    line->second = std::max(line->second, event.number);
}

// "STREAM:NUMBER:GATEWAY/LINE" for each line, with blanks between them.
std::optional<EventFollowing::Positions> EventFollowing::parse(std::string_view text) {
  Positions out;
  while (!text.empty()) {
    std::string_view one = take_part(text, ' ');
    request::EventPosition position;
    const bool numbers = parse_number(take_part(one, ':'), position.stream) &&
                         parse_number(take_part(one, ':'), position.number);
    Key key;
    const bool slash = one.find('/') != std::string_view::npos;
    if (!numbers || !slash || !parse_name(take_part(one, '/'), key.first) ||
        !parse_name(one, key.second) || out.size() >= kMostLines)
      return std::nullopt;
    out[key] = position;
  }
  return out;
}

std::string EventFollowing::position() const {
  std::string out;
  for (const auto& [key, at] : passed_) {
    out += (out.empty() ? "" : " ") + std::to_string(at.stream) + ':' + std::to_string(at.number);
    out += ':';
    append_name(out, key.first);
    out += '/';
    append_name(out, key.second);
  }
  return out;
}

EventFollowing::EventFollowing(std::optional<Positions> after)
    : from_now_(!after), follower_(!from_now_) {
  if (!after)
    return;
  passed_ = *std::move(after);
  for (const auto& [key, position] : passed_)
    follower_.begin_after(key.first, key.second, position);
}

// From now: once both states have come.
void EventFollowing::begin(const Key& key) {
  const auto stream = streams_.find(key.first);
  const auto newest = newest_.find(key);
  if (!from_now_ || stream == streams_.end() || newest == newest_.end() || begun_.contains(key))
    return;
  begun_.insert(key);
  if (stream->second == 0)  // its events belong to no sequence
    return;
  passed_[key] = {stream->second, newest->second};
  follower_.begin_after(key.first, key.second, passed_[key]);
}

void EventFollowing::receive(const NewestEvents& newest, Instant now) {
  for (const auto& [gateway, known] : newest.gateways) {
    dds::GatewayInfo info;
    info.event_stream = known.stream;
    const auto events = newest.lines.find({gateway, ""});
    info.events = events == newest.lines.end() ? 0 : events->second;
    receive_gateway({.gateway = gateway, .incarnation = known.incarnation}, info, now);
  }
  for (const auto& [key, number] : newest.lines) {
    if (!key.second.empty())
      receive_line({.gateway = key.first, .line = key.second}, number, now);
  }
}

void EventFollowing::receive_gateway(const dds::Source& source, const dds::GatewayInfo& info,
                                     Instant now) {
  if (from_now_ && (streams_.size() < kMostLines || streams_.contains(source.gateway))) {
    streams_.try_emplace(source.gateway, info.event_stream);
    newest_.try_emplace({source.gateway, ""}, info.events);
    for (auto it = newest_.lower_bound({source.gateway, ""});
         it != newest_.end() && it->first.first == source.gateway; ++it)
      begin(it->first);
  }
  follower_.receive_gateway(source.gateway, source.incarnation, info.event_stream, info.events,
                            now);
}

void EventFollowing::receive_line(const dds::Source& source, std::uint64_t newest, Instant now) {
  const Key key(source.gateway, source.line);
  if (from_now_) {
    if (newest_.size() >= 2 * kMostLines && !newest_.contains(key))
      return;
    newest_.try_emplace(key, newest);
    begin(key);
    if (!begun_.contains(key))
      return;
  }
  follower_.receive_line(source.gateway, source.line, newest, now);
}

// Samples before the states are those that a late joiner gets, or the journal has them.
void EventFollowing::take(dds::FollowedEvent event, Instant now) {
  if (!from_now_ || begun_.contains({event.source.gateway, event.source.line}))
    follower_.take(std::move(event), now);
}

bool EventFollowing::receive_answer(const dds::CommandResult& result, Instant now) {
  const auto request = requests_.extract(result.id);
  if (!request)
    return false;
  follower_.receive_answer(request.mapped().gateway, request.mapped().line, result, now);
  return true;
}

void EventFollowing::ask(Link& link) {
  while (auto fetch = follower_.due(link.now())) {
    const std::uint64_t id = link.send(fetch->target, fetch->read, kPageTimeout, 0);
    if (id != 0) {
      requests_.emplace(id, std::move(fetch->target));
      continue;
    }
    dds::CommandResult refused;
    refused.reply.error = line::to_error(line::Refusal::not_permitted);
    follower_.receive_answer(fetch->target.gateway, fetch->target.line, refused, link.now());
  }
}

bool EventFollowing::pop(Event& event) {
  for (dds::EventFollower::Item item; follower_.pop(item);) {
    if (const auto* const missing = std::get_if<dds::MissingEvents>(&item)) {
      gaps_[{missing->gateway, missing->line}].missed += missing->last - missing->first + 1;
    } else if (const auto* const stream = std::get_if<dds::NewEventStream>(&item)) {
      Gap& gap = gaps_[{stream->gateway, stream->line}];
      gap.journal_lost = gap.journal_lost || stream->lost;
    } else if (const auto* const one = std::get_if<dds::FollowedEvent>(&item)) {
      event = event_of(one->source, one->event, one->text);
      if (const auto gap = gaps_.extract({event.gateway, event.line})) {
        event.missed = gap.mapped().missed;
        event.journal_lost = gap.mapped().journal_lost;
      }
      return true;
    }
  }
  return false;
}

void EventFollowing::pass(const Event& event) {
  const bool has_room =
      passed_.size() < kMostLines || passed_.contains({event.gateway, event.line});
  if (event.stream != 0 && event.number != 0 && has_room)
    passed_[{event.gateway, event.line}] = {event.stream, event.number};
}

}  // namespace linegate::client
