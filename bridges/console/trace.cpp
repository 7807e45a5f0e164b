// SPDX-License-Identifier: Apache-2.0
// `linegate trace`: routing events as they occur, and changes of each line's routing counters.
// Lines report single connections only while a client requests it.
#include <algorithm>
#include <array>
#include <chrono>
#include <deque>
#include <map>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "bridges/console/commands.h"
#include "bridges/console/json_text.h"
#include "bridges/console/lookup.h"
#include "bridges/console/one_line.h"
#include "bridges/console/routes.h"
#include "bridges/console/table.h"
#include "bridges/console/tables.h"

namespace linegate::console {
namespace {

// Connections of a line's clients, and connections that enter the line.
struct Counted {
  std::string_view property;
  std::string_view words;
};
constexpr std::array<Counted, 9> kCounted{
    {{"opened", "opened"},
     {"finished", "finished"},
     {"aborted", "aborted"},
     {"timed-out", "timed out"},
     {"refused", "refused"},
     {"not-permitted", "not let in"},
     {"forwarded", "forwarded frames sent on this line"},
     {"emcys", "EMCYs handed to other lines"},
     {"values", "values taken over from PDOs of other lines"}}};
using Counts = std::array<std::uint64_t, kCounted.size()>;

Counts counts_of(const LineView& view) {
  Counts out{};
  for (std::size_t i = 0; i < kCounted.size(); ++i) {
    out[i] = routing_count(view, kCounted[i].property).value_or(0);
  }
  return out;
}

// A line stops reporting this long after the last request.
constexpr std::chrono::seconds kLease{30};
constexpr Duration kAskAgain = std::chrono::seconds(10);
constexpr std::size_t kMostEarly = 1000;

bool is_of_routing(EventKind kind) {
  return kind == EventKind::routing_refused || kind == EventKind::emcy_routed ||
         kind == EventKind::routing_opened || kind == EventKind::routing_ended;
}

class Tracer {
 public:
  explicit Tracer(Context& context) : context_(context) {}

  // Returns the number of printed lines.
  std::uint64_t look(const Model& model) {
    const std::uint64_t before = printed_;
    for (const auto& [id, line] : model.lines()) {
      if (line.gone) {
        traced_.erase(id);
      } else if (line.view) {
        look(id, *line.view);
      }
    }
    events(model);
    return printed_ - before;
  }
  // Renews the request to each routing line to report its connections.
  void ask(Model& model) {
    const auto now = std::chrono::steady_clock::now();
    std::vector<LineId> due;
    for (auto& [id, traced] : traced_) {
      if (traced.routes && !traced.refuses && now >= traced.ask_at) {
        traced.ask_at = now + kAskAgain;
        due.push_back(id);
      }
    }
    for (const LineId& id : due) {
      ask(model, id);
    }
  }

 private:
  struct Traced {
    Counts last{};
    bool routes = false;
    bool refuses = false;
    std::chrono::steady_clock::time_point ask_at{};
    std::uint64_t events = 0;  // number in its last state
    std::uint64_t kept = 0;    // events up to this number happened before the trace started
  };

  void look(const LineId& id, const LineView& view) {
    const Counts now = counts_of(view);
    const std::uint64_t events = view.state.counters.events;
    const auto [known, first] =
        traced_.try_emplace(id, Traced{.last = now, .events = events, .kept = events});
    Traced& traced = known->second;
    traced.routes = routing_count(view, "open").has_value();
    if (events < traced.events) {
      traced.kept = 0;  // its gateway was restarted
    }
    traced.events = events;
    if (!first && now != traced.last) {
      print_changes(id, view, traced.last, now);
    }
    traced.last = now;
  }

  void ask(Model& model, const LineId& id) {
    const line::Command command{.request = line::RoutingTrace{.duration = kLease}};
    const Client::Answer answer = context_.client.call(id, command, context_.timeout, 0, model);
    const bool silent = answer.reply.error == line::to_error(line::Refusal::timed_out);
    if (!answer.reply.ok() && !silent) {
      traced_[id].refuses = true;
      context_.err << printable(id.line)
                   << " does not report single connections: " << printable(answer.text) << '\n';
    }
  }

  // A restarted gateway counts from 0.
  static std::uint64_t moved(std::uint64_t last, std::uint64_t now) {
    return now >= last ? now - last : now;
  }

  void print_changes(const LineId& id, const LineView& view, const Counts& last,
                     const Counts& now) {
    ++printed_;
    if (context_.json) {
      nlohmann::ordered_json out{{"time", date_text(view.time)},
                                 {"gateway", id.gateway},
                                 {"line", id.line},
                                 {"network_id", view.state.network_id}};
      for (std::size_t i = 0; i < now.size(); ++i) {
        std::string key(kCounted[i].property);
        std::ranges::replace(key, '-', '_');
        out[key] = moved(last[i], now[i]);
      }
      context_.out << one_line(out) << std::endl;
      return;
    }
    std::string text;
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (const std::uint64_t more = moved(last[i], now[i]); more != 0) {
        text += (text.empty() ? "" : ", ") + std::to_string(more) + ' ' +
                std::string(kCounted[i].words);
      }
    }
    context_.out << stamp_of(context_)(view.time) << ' ' << printable(id.line) << " (network "
                 << view.state.network_id << "): " << text << "; open "
                 << routing_count(view, "open").value_or(0) << std::endl;
  }

  // Kept events from before the trace are not shown; the state of the line shows which ones they
  // are.
  void events(const Model& model) {
    std::deque<KnownEvent> fresh = std::exchange(early_, {});
    const auto more = static_cast<std::ptrdiff_t>(
        std::min<std::uint64_t>(model.events_seen() - seen_, model.events().size()));
    seen_ = model.events_seen();
    fresh.insert(fresh.end(), model.events().end() - more, model.events().end());
    for (const KnownEvent& one : fresh) {
      if (!is_of_routing(one.view.kind)) {
        continue;
      }
      const auto traced = traced_.find(one.id);
      if (traced == traced_.end()) {
        early_.push_back(one);
      } else if (one.view.number > traced->second.kept) {
        ++printed_;
        context_.out << (context_.json ? event_json(one.id, one.view)
                                       : event_text(one.id, one.view, stamp_of(context_)))
                     << std::endl;
      }
    }
    if (early_.size() > kMostEarly) {
      early_.erase(early_.begin(), early_.end() - kMostEarly);
    }
  }

  Context& context_;
  std::map<LineId, Traced> traced_;
  std::deque<KnownEvent> early_;  // of lines without a received state
  std::uint64_t seen_ = 0;
  std::uint64_t printed_ = 0;
};

}  // namespace

int trace(Context& context, std::uint64_t count, const std::function<bool()>& stopped) {
  Model model;
  Tracer tracer(context);
  std::uint64_t printed = 0;
  const auto end = std::chrono::steady_clock::now() + context.wait;
  while (!stopped() && (count == 0 || printed < count)) {
    poll(context, model, std::chrono::milliseconds(100));
    printed += tracer.look(model);
    tracer.ask(model);
    if (model.lines().empty() && std::chrono::steady_clock::now() >= end) {
      context.err << no_line_text(context, model, "") << '\n';
      return kFailed;
    }
  }
  return kDone;
}

}  // namespace linegate::console
