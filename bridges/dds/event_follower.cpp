// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/event_follower.h"

#include <algorithm>
#include <limits>
#include <string_view>

#include "bridges/dds/event_codec.h"
#include "stack/line/event_severity.h"

namespace linegate::dds {
namespace {

constexpr std::size_t kMostPastStreams = 64;
constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();

// Appends to a list of streams, from which the oldest one makes room.
template <class T>
void append_stream(std::deque<T>& to, T one) {
  if (to.size() >= kMostPastStreams)
    to.pop_front();
  to.push_back(one);
}

FollowedEvent followed_event(const std::string& gateway, request::JournalRecord record) {
  FollowedEvent out;
  out.source = {gateway, std::move(record.line), record.incarnation, record.time,
                static_cast<ClockQuality>(record.clock)};
  EventFields fields{.code = record.code, .value = record.value};
  fields.length = static_cast<std::uint8_t>(std::min(record.data.size(), fields.data.size()));
  std::copy_n(record.data.begin(), fields.length, fields.data.begin());
  out.event = {.number = record.number,
               .stream = record.stream,
               .time = record.time,
               .kind = record.kind,
               .severity = record.severity,
               .node = record.node,
               .fields = fields,
               .data = unpack(record.kind, fields)};
  out.text = std::move(record.text);
  return out;
}

bool is_refused(const CommandResult& result, line::Refusal refusal) {
  return result.reply.error == line::to_error(refusal);
}

// As opposed to one that cannot be read (yet).
bool has_no_journal(const CommandResult& result) {
  const auto& why = result.reply.bytes();
  return is_refused(result, line::Refusal::wrong_state) &&
         std::string_view(reinterpret_cast<const char*>(why.data()), why.size())
             .starts_with(request::kNoJournal);
}

}  // namespace

// --- in ------------------------------------------------------------------------------------------

void EventFollower::begin_after(const std::string& gateway, const std::string& name,
                                request::EventPosition position) {
  if (Line* const known = line(gateway, name)) {
    known->position = position;
  }
}

EventFollower::Line* EventFollower::line(const std::string& gateway, const std::string& name) {
  const auto found = lines_.find({gateway, name});
  if (found != lines_.end())
    return &found->second;
  if (lines_.size() >= kMostLines)
    return nullptr;
  Line& made = lines_[{gateway, name}];
  made.gateway = gateway;
  made.name = name;
  made.from_oldest = from_oldest_;
  return &made;
}

const EventFollower::Gateway& EventFollower::gateway_of(const Line& line) const {
  static const Gateway kUnknown;
  const auto found = gateways_.find(line.gateway);
  return found == gateways_.end() ? kUnknown : found->second;
}

// A gateway that was started again: events of its last run may be missing, of which no sample
// exists.
void EventFollower::receive_gateway(const std::string& gateway, std::uint64_t incarnation,
                                    std::uint64_t stream, std::uint64_t newest, Instant now) {
  if (!gateways_.contains(gateway) && gateways_.size() >= kMostLines)
    return;
  Gateway& known = gateways_[gateway];
  const bool is_new = known.incarnation != incarnation;
  known = {incarnation, stream};
  receive_line(gateway, "", newest, now);
  for (auto& [key, one] : lines_) {
    if (key.first != gateway)
      continue;
    if (is_new && (one.position || one.pending_count != 0)) {
      one.unchecked = true;
      one.pause = kFirstPause;
      one.missed_since = kNever;
      ask(one, now);
    }
  }
}

void EventFollower::receive_line(const std::string& gateway, const std::string& name,
                                 std::uint64_t newest, Instant now) {
  Line* const known = line(gateway, name);
  if (known == nullptr)
    return;
  known->newest = newest;
  if (known->ask_at == kNever && is_behind(*known))
    ask(*known, now + (known->position ? kGrace : Duration::zero()));
}

// Whether events are known to exist that were not passed on.
bool EventFollower::is_behind(const Line& line) const {
  if (!line.position)
    return line.from_oldest || line.pending_count != 0;
  const Gateway& gateway = gateway_of(line);
  return line.unchecked || line.pending_count != 0 ||
         (gateway.stream != 0 && gateway.stream != line.position->stream) ||
         line.newest > line.position->number;
}

// Whether the event was passed on, or is of a stream that ended.
bool EventFollower::is_passed(const Line& line, request::EventPosition at) const {
  if (line.position && line.position->stream == at.stream)
    return at.number <= line.position->number;
  const auto end = std::ranges::find(line.past, at.stream, &request::EventPosition::stream);
  if (end == line.past.end())
    return false;
  return at.number <= end->number || at.stream != gateway_of(line).stream;
}

// The journal has one event without a number of a stream at most.
bool EventFollower::is_first_unnumbered(Line& line, std::uint64_t stream) {
  const bool is_first = std::ranges::find(line.unnumbered, stream) == line.unnumbered.end();
  if (is_first)
    append_stream(line.unnumbered, stream);
  return is_first;
}

void EventFollower::take(FollowedEvent event, Instant now) {
  Line* const known = line(event.source.gateway, event.source.line);
  const request::EventPosition at{event.event.stream, event.event.number};
  if (known == nullptr || at.stream == 0 || at.number == 0) {
    if (known != nullptr && at.stream != 0)
      (void)is_first_unnumbered(*known, at.stream);
    items_.emplace_back(std::move(event));
    return;
  }
  if (!known->position && !known->from_oldest)
    known->position = {at.stream, at.number - 1};
  const bool is_present = known->position && known->position->stream == at.stream;
  known->sampled = known->sampled || is_present;
  if (is_passed(*known, at))
    return;
  const bool was_complete = known->pending_count == 0;
  if (known->pending_count < kMostPending) {
    auto waiting = std::ranges::find(known->pending, at.stream, &Pending::stream);
    if (waiting == known->pending.end())
      waiting = known->pending.insert(waiting, {.stream = at.stream, .follows = known->sampled});
    known->pending_count += waiting->events.emplace(at.number, std::move(event)).second ? 1U : 0U;
  }
  deliver_pending(*known);
  if (known->pending_count == 0)
    return;
  if (was_complete || known->ask_at == kNever)  // else after the pause for the same gap
    ask(*known, now);
}

void EventFollower::ask(Line& line, Instant at) {
  if (!line.asking)
    line.ask_at = earlier(line.ask_at, at);
}

// --- order ---------------------------------------------------------------------------------------

void EventFollower::deliver(Line& line, FollowedEvent event) {
  line.position = {event.event.stream, event.event.number};
  line.pause = kFirstPause;
  line.missed_since = kNever;
  items_.emplace_back(std::move(event));
}

// Those that follow the last one without a gap.
void EventFollower::deliver_pending(Line& line) {
  if (!line.position)
    return;
  const auto found = std::ranges::find(line.pending, line.position->stream, &Pending::stream);
  if (found == line.pending.end())
    return;
  auto& waiting = found->events;
  while (!waiting.empty() && waiting.begin()->first <= line.position->number + 1) {
    auto first = waiting.extract(waiting.begin());
    --line.pending_count;
    if (first.key() > line.position->number)
      deliver(line, std::move(first.mapped()));
  }
  if (waiting.empty())
    line.pending.erase(found);
}

// Those of the present stream before that number, and the gaps between them.
void EventFollower::deliver_before(Line& line, std::uint64_t number) {
  const auto report_missing = [&](std::uint64_t next) {
    if (next > line.position->number + 1) {
      items_.emplace_back(MissingEvents{line.gateway, line.name, line.position->stream,
                                        line.position->number + 1, next - 1});
      line.position->number = next - 1;
    }
  };
  for (deliver_pending(line);; deliver_pending(line)) {
    const auto found = std::ranges::find(line.pending, line.position->stream, &Pending::stream);
    if (found == line.pending.end() ||
        (number != kNoLimit && found->events.begin()->first >= number))
      break;
    report_missing(found->events.begin()->first);
  }
  if (number != kNoLimit)
    report_missing(number);
}

// The samples of the present stream, and the gaps between them.
void EventFollower::deliver_all(Line& line) {
  if (line.position)
    deliver_before(line, kNoLimit);
}

void EventFollower::enter_stream(Line& line, std::uint64_t stream, std::uint64_t before_first) {
  if (line.position) {
    items_.emplace_back(
        NewEventStream{line.gateway, line.name, line.position->stream, stream, line.lost});
    append_stream(line.past, *line.position);
  }
  line.lost = false;
  // Samples of the stream may be older than the first entry of the journal
  const auto waiting = std::ranges::find(line.pending, stream, &Pending::stream);
  line.sampled = waiting != line.pending.end();
  if (line.sampled)
    before_first = std::min(before_first, waiting->events.begin()->first - 1);
  const auto end = std::ranges::find(line.past, stream, &request::EventPosition::stream);
  if (end != line.past.end()) {
    before_first = end->number;
    line.past.erase(end);
  }
  line.position = {stream, before_first};
}

// The journal does not have streams that are left out, such as those while the disk failed: their
// samples are passed on if they are known to be between the present stream and the next one.
void EventFollower::change_stream(Line& line, std::uint64_t stream, std::uint64_t before_first) {
  deliver_all(line);
  for (;;) {
    const auto next = std::ranges::find(line.pending, stream, &Pending::stream);
    const bool is_newest = next != line.pending.end() || stream == gateway_of(line).stream;
    const auto between = std::ranges::find_if(line.pending.begin(), next, &Pending::follows);
    if (!line.position || !is_newest || between == next)
      break;
    enter_stream(line, between->stream, kNoLimit);
    deliver_all(line);
  }
  enter_stream(line, stream, before_first);
}

// --- the journal ---------------------------------------------------------------------------------

std::optional<EventFollower::Fetch> EventFollower::due(Instant now) {
  for (auto& [key, line] : lines_) {
    if (line.asking || line.ask_at > now || gateway_of(line).stream == 0)
      continue;
    line.ask_at = kNever;
    const bool has_more = line.cursor != request::JournalCursor{};
    if (!has_more && !is_behind(line))
      continue;
    line.asking = true;
    Fetch fetch{.target = {.gateway = line.gateway, .line = line.name},
                .read = {.line = line.name, .after = line.position, .cursor = line.cursor}};
    return fetch;
  }
  return std::nullopt;
}

Instant EventFollower::next_wake() const {
  Instant next = kNever;
  for (const auto& [key, line] : lines_) {
    if (!line.asking && gateway_of(line).stream != 0)
      next = earlier(next, line.ask_at);
  }
  return next;
}

void EventFollower::receive_answer(const std::string& gateway, const std::string& name,
                                   const CommandResult& result, Instant now) {
  const auto found = lines_.find({gateway, name});
  if (found == lines_.end())
    return;
  Line& line = found->second;
  line.asking = false;
  auto page = result.reply.ok() ? request::decode_page(result.reply.bytes()) : std::nullopt;
  if (page) {
    receive_page(line, *std::move(page), now);
  } else {
    receive_refusal(line, result, now);
  }
}

void EventFollower::receive_page(Line& line, request::JournalPage page, Instant now) {
  const bool is_first = line.cursor == request::JournalCursor{};
  if (is_first && page.unknown_stream && line.position) {
    // Of the present stream, the journal has not stored an event of the line yet
    if (line.position->stream == gateway_of(line).stream)
      return wait_for_journal(line, now);
    line.lost = true;
  }
  for (request::JournalRecord& record : page.records) {
    if (record.line == line.name)
      receive_record(line, std::move(record));
  }
  deliver_pending(line);
  if (page.more) {
    line.cursor = page.cursor;
    line.ask_at = now;
    return;
  }
  line.cursor = {};
  wait_for_journal(line, now);
}

void EventFollower::receive_record(Line& line, request::JournalRecord record) {
  const request::EventPosition at{record.stream, record.number};
  if (at.number == 0) {
    if (is_first_unnumbered(line, at.stream))
      items_.emplace_back(followed_event(line.gateway, std::move(record)));
    return;
  }
  if (is_passed(line, at))
    return;
  if (!line.position || line.position->stream != record.stream)
    change_stream(line, record.stream, record.number - 1);
  if (record.number <= line.position->number)
    return;
  deliver_before(line, record.number);
  if (record.number <= line.position->number)
    return;
  deliver(line, followed_event(line.gateway, std::move(record)));
  deliver_pending(line);
}

// The end of the journal was reached: what is missing is stored soon, or never.
void EventFollower::wait_for_journal(Line& line, Instant now) {
  line.unchecked = false;
  if (!is_behind(line)) {
    line.missed_since = kNever;
    return;
  }
  if (line.missed_since == kNever) {
    line.missed_since = now;
  } else if (line.pending_count != 0 && now - line.missed_since >= kPatience) {
    give_up(line, kNoLimit);
  }
  line.ask_at = now + line.pause;
  line.pause = std::min(2 * line.pause, kLongestPause);
}

// What is missing is lost. Each run of the gateway is a stream, from 1 on.
void EventFollower::continue_without_journal(Line& line, Instant now) {
  const std::uint64_t stream = gateway_of(line).stream;
  if (line.pending_count != 0 && line.pending.back().stream == stream) {
    line.lost = line.position && line.position->stream != stream;
    give_up(line, line.position ? 0 : kNoLimit);
  } else {
    deliver_all(line);  // others may be of a later run, of which no state has come
  }
  wait_for_journal(line, now);
}

// The samples that wait are continued with. Other samples are of streams that are older than those
// of the line and of the gateway. before_first: as in enter_stream(), of the stream of the gateway.
void EventFollower::give_up(Line& line, std::uint64_t before_first) {
  const std::uint64_t stream = gateway_of(line).stream;
  deliver_all(line);
  const bool is_behind_gateway = line.position && line.position->stream != stream;
  if (std::ranges::find(line.pending, stream, &Pending::stream) != line.pending.end()) {
    change_stream(line, stream, before_first);
    deliver_all(line);
  } else if (const auto last = std::ranges::find(line.pending.rbegin(), line.pending.rend(), true,
                                                 &Pending::follows);
             is_behind_gateway && last != line.pending.rend()) {
    change_stream(line, last->stream, kNoLimit);
    deliver_all(line);
  }
  for (const Pending& older : line.pending)
    append_stream(line.past, {older.stream, older.events.rbegin()->first});
  line.pending.clear();
  line.pending_count = 0;
  line.missed_since = kNever;
}

void EventFollower::receive_refusal(Line& line, const CommandResult& result, Instant now) {
  if (is_refused(result, line::Refusal::wrong_incarnation) &&
      line.cursor != request::JournalCursor{}) {
    line.cursor = {};  // the file was replaced: after the last event again
    line.ask_at = now;
    return;
  }
  if (has_no_journal(result)) {
    continue_without_journal(line, now);
    return;
  }
  const bool later = result.reply.ok() || is_refused(result, line::Refusal::timed_out) ||
                     is_refused(result, line::Refusal::busy) ||
                     is_refused(result, line::Refusal::cancelled);
  if (!later) {
    wait_for_journal(line, now);  // it is not readable (yet)
    return;
  }
  line.ask_at = now + line.pause;
  line.pause = std::min(2 * line.pause, kLongestPause);
}

bool EventFollower::pop(Item& item) {
  if (items_.empty())
    return false;
  item = std::move(items_.front());
  items_.pop_front();
  return true;
}

}  // namespace linegate::dds
