// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <ostream>
#include <tuple>

#include "bridges/console/discovery.h"
#include "bridges/console/json_text.h"
#include "bridges/console/lookup.h"
#include "bridges/console/monitor.h"
#include "bridges/console/tables.h"

namespace linegate::console {
namespace {

constexpr Duration kPicture = std::chrono::seconds(2);
constexpr Duration kPicturePoll = std::chrono::milliseconds(100);
constexpr std::size_t kShownEvents = 20;

void print_table(std::ostream& out, const std::string& headline, const Table& table) {
  out << "\n--- " << headline << '\n';
  print(out, text_of(table));
}

class TextMonitor {
 public:
  TextMonitor(Context& context, const MonitorOptions& options, const Model& model)
      : context_(context), filter_(options.filter), model_(model) {}

  // The whole state, once.
  void all() {
    if (context_.json) {
      context_.out << plant_json(model_, filter_, utc_now()) << std::endl;
      return;
    }
    tables();
    Table events = events_of(model_, filter_, Model::kKeptEvents, stamp_of(context_));
    std::ranges::sort(events.rows, {}, [](const Row& row) {
      return std::tuple(row.cells[0].number.value_or(0), row.key.id, row.key.number);
    });
    if (events.rows.size() > kShownEvents) {
      events.rows.erase(events.rows.begin(), events.rows.end() - kShownEvents);
    }
    print_table(context_.out, "the newest events", events);
    context_.out << std::flush;
  }

  // The present state, without events.
  void picture() {
    if (context_.json) {
      context_.out << stream_lines_json(model_, filter_) << '\n';
      for (const Line* line : model_.find(filter_.line)) {
        for (const auto direction : {image::Direction::inputs, image::Direction::outputs}) {
          context_.out << stream_image_json(*line, direction, filter_.node) << '\n';
        }
      }
    } else {
      tables();
    }
    context_.out << std::flush;
  }

  void new_events() {
    const std::uint64_t fresh =
        std::min<std::uint64_t>(model_.events_seen() - seen_, model_.events().size());
    seen_ = model_.events_seen();
    for (auto it = model_.events().end() - static_cast<std::ptrdiff_t>(fresh);
         it != model_.events().end(); ++it) {
      if (is_meant(*it)) {
        context_.out << (context_.json
                             ? stream_event_json(it->id, it->view)
                             : "event " + event_text(it->id, it->view, stamp_of(context_)))
                     << '\n';
      }
    }
    context_.out << std::flush;
  }

 private:
  void tables() {
    print_table(context_.out, "lines at " + stamp_of(context_)(utc_now()),
                lines_of(model_, filter_));
    print_table(context_.out, "nodes", nodes_of(model_, filter_, stamp_of(context_)));
    print_table(context_.out, "values", values_of(model_, filter_, Directions::both));
  }

  bool is_meant(const KnownEvent& event) const {
    const auto lines = model_.find(filter_.line);
    return (filter_.node == 0 || filter_.node == event.view.node) &&
           std::any_of(lines.begin(), lines.end(),
                       [&](const Line* line) { return line->id == event.id; });
  }

  Context& context_;
  const Filter& filter_;
  const Model& model_;
  std::uint64_t seen_ = 0;  // number of printed events
};

// Whether the state of the line was received, and its values if it has an image.
bool is_complete(const Line& line) {
  return line.view && std::all_of(line.areas.begin(), line.areas.end(), [](const Area& area) {
           return area.complete() || (area.layout && area.layout->entries.empty());
         });
}

int monitor_once(Context& context, const MonitorOptions& options, Model& model,
                 const std::function<bool()>& stopped) {
  const auto have_all = [&] {
    const auto lines = model.find(options.filter.line);
    return stopped() || (!lines.empty() && is_settled(context, model) &&
                         std::all_of(lines.begin(), lines.end(), [&](const Line* line) {
                           return line->gone || is_complete(*line) || is_removed(model, *line);
                         }));
  };
  const bool complete = wait_until(context, model, have_all);
  if (model.find(options.filter.line).empty()) {
    context.err << no_line_text(context, model, options.filter.line) << '\n';
    return kFailed;
  }
  TextMonitor(context, options, model).all();
  if (complete) {
    return kDone;
  }
  if (completeness(context, model) == kDone) {
    context.err << "incomplete: not all images were received\n";
  }
  return kIncomplete;
}

}  // namespace

int monitor_text(Context& context, const MonitorOptions& options, Model& model,
                 const std::function<bool()>& stopped) {
  if (options.once) {
    return monitor_once(context, options, model, stopped);
  }
  const Instant begin = steady_now();
  const bool heard =
      wait_until(context, model, [&] { return !model.lines().empty() || stopped(); });
  if (!heard) {
    context.err << no_line_text(context, model, "") << '\n';
    return kFailed;
  }
  TextMonitor monitor(context, options, model);
  Instant next_picture = begin;
  while (!stopped()) {
    monitor.new_events();
    if (steady_now() >= next_picture) {
      monitor.picture();
      next_picture += kPicture;
    }
    if (options.duration > Duration::zero() && steady_now() - begin >= options.duration) {
      break;
    }
    poll(context, model, kPicturePoll);
  }
  return kDone;
}

}  // namespace linegate::console
