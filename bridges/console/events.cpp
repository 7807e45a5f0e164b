// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/events.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <ctime>
#include <deque>
#include <map>
#include <ostream>
#include <tuple>
#include <utility>
#include <vector>

#include "bridges/console/json_text.h"
#include "bridges/console/lookup.h"
#include "bridges/console/tables.h"

namespace linegate::console {
namespace {

constexpr Duration kEventPoll = std::chrono::milliseconds(100);

std::optional<Duration> parse_ago(const std::string& text) {
  constexpr std::array<std::pair<std::string_view, std::int64_t>, 4> kUnits{
      {{"min", 60}, {"s", 1}, {"h", 3600}, {"d", 86'400}}};
  constexpr std::int64_t kMost = 36'500;  // of any unit
  std::int64_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  const std::string_view unit(rest, static_cast<std::size_t>(end - rest));
  const auto* const known =
      std::ranges::find(kUnits, unit, &std::pair<std::string_view, std::int64_t>::first);
  if (error != std::errc{} || number < 0 || number > kMost || known == kUnits.end()) {
    return std::nullopt;
  }
  return std::chrono::seconds(number * known->second);
}

// Removes up to 9 digits of a second from the end of "... 12:34:56.320". Nothing if there are more,
// or what is before them has no seconds.
std::optional<Duration> take_fraction(std::string& text) {
  constexpr std::size_t kMostDigits = 9;
  const std::size_t stop = text.rfind('.');
  if (stop == std::string::npos) {
    return Duration::zero();
  }
  std::string digits = text.substr(stop + 1);
  const bool good = !digits.empty() && digits.size() <= kMostDigits &&
                    std::ranges::all_of(digits, [](char c) { return c >= '0' && c <= '9'; });
  if (!good || std::ranges::count(text.substr(0, stop), ':') != 2) {
    return std::nullopt;
  }
  text.resize(stop);
  digits.resize(kMostDigits, '0');
  return std::chrono::nanoseconds(std::stol(digits));
}

std::optional<Instant> parse_date(std::string text) {
  const bool utc = text.ends_with('Z');
  if (utc) {
    text.pop_back();
  }
  std::ranges::replace(text, 'T', ' ');
  const auto fraction = take_fraction(text);
  for (const char* form : {"%Y-%m-%d %H:%M:%S", "%Y-%m-%d %H:%M", "%Y-%m-%d"}) {
    std::tm parts{};
    parts.tm_isdst = -1;
    const char* const rest = ::strptime(text.c_str(), form, &parts);
    // mktime() would take the 30th of February for a day of March.
    const std::chrono::year_month_day date{
        std::chrono::year{parts.tm_year + 1900},
        std::chrono::month{static_cast<unsigned>(parts.tm_mon + 1)},
        std::chrono::day{static_cast<unsigned>(parts.tm_mday)}};
    if (fraction && rest != nullptr && *rest == '\0' && date.ok()) {
      return Instant(std::chrono::seconds(utc ? ::timegm(&parts) : std::mktime(&parts))) +
             *fraction;
    }
  }
  return std::nullopt;
}

// Days differ in their length when the local time is changed.
std::optional<Instant> parse_day(const std::string& text, Instant now) {
  if (text != "today" && text != "yesterday") {
    return std::nullopt;
  }
  const auto seconds = static_cast<std::time_t>(
      std::chrono::floor<std::chrono::seconds>(now.time_since_epoch()).count());
  std::tm parts{};
  ::localtime_r(&seconds, &parts);
  parts.tm_hour = parts.tm_min = parts.tm_sec = 0;
  parts.tm_mday -= text == "yesterday" ? 1 : 0;
  parts.tm_isdst = -1;
  return Instant(std::chrono::seconds(std::mktime(&parts)));
}

// The received events that match the request, in order.
class EventList {
 public:
  EventList(Context& context, const EventsRequest& request, Instant since, EventSeverity least)
      : context_(context), request_(request), since_(since), least_(least) {}

  // Adds the events that the last poll received.
  void take(const Model& model) {
    const auto fresh = static_cast<std::ptrdiff_t>(
        std::min<std::uint64_t>(model.events_seen() - seen_, model.events().size()));
    seen_ = model.events_seen();
    for (auto it = model.events().end() - fresh; it != model.events().end(); ++it) {
      std::uint64_t& newest = newest_[it->id];
      newest = std::max(newest, it->view.number);
      waiting_.push_back(*it);
    }
  }

  // Whether every event up to the number in each line's last LineState was received.
  bool is_complete(const std::vector<const Line*>& lines) const {
    return std::ranges::all_of(lines, [&](const Line* line) {
      const auto newest = newest_.find(line->id);
      const std::uint64_t received = newest == newest_.end() ? 0 : newest->second;
      return line->gone || (line->view && received >= line->view->state.counters.events);
    });
  }

  // Prints the newest `most` events that were received and returns their number.
  std::uint64_t print(const Model& model, std::uint64_t most) {
    std::vector<KnownEvent> out;
    const auto lines = model.find(request_.line);
    for (KnownEvent& one : std::exchange(waiting_, {})) {
      if ((request_.line.empty() || is_meant(lines, one.id)) && one.view.time >= since_ &&
          one.view.severity >= least_) {
        out.push_back(std::move(one));
      }
    }
    std::ranges::sort(out, {}, [](const KnownEvent& one) {
      return std::tuple(one.view.time, one.id, one.view.number);
    });
    const std::size_t left_out = out.size() - std::min<std::uint64_t>(out.size(), most);
    for (std::size_t i = left_out; i < out.size(); ++i) {
      context_.out << (context_.json ? event_json(out[i].id, out[i].view)
                                     : event_text(out[i].id, out[i].view, stamp_of(context_)))
                   << '\n';
    }
    context_.out << std::flush;
    return out.size() - left_out;
  }

 private:
  Context& context_;
  const EventsRequest& request_;
  Instant since_;
  EventSeverity least_;
  std::deque<KnownEvent> waiting_;
  std::map<LineId, std::uint64_t> newest_;  // event numbers
  std::uint64_t seen_ = 0;
};

// Prints the kept events. Returns kDone, or the exit code to end with.
int print_kept(Context& context, Model& model, const EventsRequest& request, EventList& list,
               const std::function<bool()>& stopped, std::uint64_t& left) {
  const bool complete = wait_until_settled(context, model, [&] {
    list.take(model);
    const auto lines = model.find(request.line);
    return stopped() || (!lines.empty() && list.is_complete(lines));
  });
  list.take(model);
  if (model.find(request.line).empty()) {
    context.err << no_line_text(context, model, request.line) << '\n';
    return kFailed;
  }
  left -= list.print(model, left);
  if (complete || stopped()) {
    return kDone;
  }
  if (completeness(context, model) == kDone) {
    context.err << "incomplete: not all events that are kept were received\n";
  }
  return kIncomplete;
}

}  // namespace

std::optional<EventSeverity> severity_named(const std::string& text) {
  for (const auto severity : {EventSeverity::info, EventSeverity::warning, EventSeverity::error}) {
    if (text.empty() || text == name(severity)) {
      return severity;
    }
  }
  return std::nullopt;
}

std::optional<Instant> parse_since(const std::string& text, Instant now) {
  if (const auto ago = parse_ago(text)) {
    return now - *ago;
  }
  const auto day = parse_day(text, now);
  return day ? day : parse_date(text);
}

int events(Context& context, const EventsRequest& request, const std::function<bool()>& stopped) {
  const auto least = severity_named(request.severity);
  const auto since =
      request.since.empty() ? std::optional(Instant{}) : parse_since(request.since, utc_now());
  if (!least || !since) {
    context.err << (least ? "'" + printable(request.since) + "' is no time: " + kTimes
                          : "severities are info, warning and error")
                << '\n';
    return kUsage;
  }
  Model model;
  EventList list(context, request, *since, *least);
  std::uint64_t left = request.count == 0 ? ~std::uint64_t{0} : request.count;
  const int code = print_kept(context, model, request, list, stopped, left);
  if (code == kFailed || request.once) {
    return code;
  }
  while (!stopped() && left > 0) {
    poll(context, model, kEventPoll);
    list.take(model);
    left -= list.print(model, left);
  }
  return code;
}

}  // namespace linegate::console
