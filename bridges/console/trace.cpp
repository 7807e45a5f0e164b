// What is routed, as it happens: events of routing, and what the counters of each line have moved.
#include <algorithm>
#include <array>
#include <chrono>
#include <map>
#include <ostream>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "bridges/console/commands.h"
#include "bridges/console/json_text.h"
#include "bridges/console/lookup.h"
#include "bridges/console/routes.h"
#include "bridges/console/tables.h"

namespace linegate::console {
namespace {

// Of the connections of a line's clients, then of those that enter it.
struct Counted {
  std::string_view property;
  std::string_view words;
};
constexpr std::array<Counted, 7> kCounted{{{"opened", "opened"},
                                           {"finished", "finished"},
                                           {"aborted", "aborted"},
                                           {"timed-out", "timed out"},
                                           {"refused", "refused"},
                                           {"not-permitted", "not let in"},
                                           {"forwarded", "frames sent here for others"}}};
using Counts = std::array<std::uint64_t, kCounted.size()>;

Counts counts_of(const LineView& view) {
  Counts out{};
  for (std::size_t i = 0; i < kCounted.size(); ++i) {
    out[i] = routing_count(view, kCounted[i].property).value_or(0);
  }
  return out;
}

class Tracer {
 public:
  explicit Tracer(Context& context) : context_(context) {}

  // Lines printed.
  std::uint64_t look(const Model& model) {
    const std::uint64_t before = printed_;
    for (const auto& [id, line] : model.lines()) {
      if (line.view && !line.gone) {
        look(id, *line.view);
      }
    }
    events(model);
    return printed_ - before;
  }

 private:
  void look(const LineId& id, const LineView& view) {
    const Counts now = counts_of(view);
    const auto [known, first] = counts_.try_emplace(id, now);
    Counts& last = known->second;
    if (!first && now != last) {
      tell(id, view, last, now);
    }
    last = now;
  }

  // A gateway that was started anew counts from 0.
  static std::uint64_t moved(std::uint64_t last, std::uint64_t now) {
    return now >= last ? now - last : now;
  }

  void tell(const LineId& id, const LineView& view, const Counts& last, const Counts& now) {
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
      context_.out << out.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)
                   << std::endl;
      return;
    }
    std::string text;
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (const std::uint64_t more = moved(last[i], now[i]); more != 0) {
        text += (text.empty() ? "" : ", ") + std::to_string(more) + ' ' +
                std::string(kCounted[i].words);
      }
    }
    context_.out << clock_text(view.time) << ' ' << printable(id.line) << " (network "
                 << view.state.network_id << "): " << text << "; open "
                 << routing_count(view, "open").value_or(0) << std::endl;
  }

  void events(const Model& model) {
    const std::uint64_t fresh =
        std::min<std::uint64_t>(model.events_seen() - seen_, model.events().size());
    seen_ = model.events_seen();
    for (auto it = model.events().end() - static_cast<std::ptrdiff_t>(fresh);
         it != model.events().end(); ++it) {
      const EventKind kind = it->view.event.kind;
      if (kind == EventKind::routing_refused || kind == EventKind::emcy_routed) {
        ++printed_;
        context_.out << (context_.json ? event_json(it->id, it->view)
                                       : event_text(it->id, it->view))
                     << std::endl;
      }
    }
  }

  Context& context_;
  std::map<LineId, Counts> counts_;
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
    if (model.lines().empty() && std::chrono::steady_clock::now() >= end) {
      context.err << "no gateway was heard of\n";
      return kFailed;
    }
  }
  return kDone;
}

}  // namespace linegate::console
