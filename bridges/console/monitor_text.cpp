#include <chrono>
#include <ostream>

#include "bridges/console/json_text.h"
#include "bridges/console/lookup.h"
#include "bridges/console/monitor.h"
#include "bridges/console/tables.h"

namespace linegate::console {
namespace {

using Clock = std::chrono::steady_clock;

constexpr Duration kPicture = std::chrono::seconds(2);
constexpr Duration kPicturePoll = std::chrono::milliseconds(100);

void picture(Context& context, const Model& model) {
  if (context.json) {
    context.out << lines_json(model.find("")) << '\n';
    for (const Line* line : model.find("")) {
      context.out << image_json(*line, image::Direction::inputs) << '\n';
    }
    context.out.flush();
    return;
  }
  context.out << "\n--- lines\n";
  print(context.out, lines_table(model));
  context.out << "\n--- nodes\n";
  print(context.out, nodes_table(model.find("")));
  for (const Line* line : model.find("")) {
    context.out << "\n--- " << line->id.line << ": inputs, " << line->images
                << " images received\n";
    print(context.out, image_table(*line, image::Direction::inputs));
  }
  context.out << std::endl;
}

std::uint64_t print_new_events(Context& context, const Model& model, std::uint64_t seen) {
  const std::uint64_t fresh =
      std::min<std::uint64_t>(model.events_seen() - seen, model.events().size());
  for (auto it = model.events().end() - static_cast<std::ptrdiff_t>(fresh);
       it != model.events().end(); ++it) {
    context.out << (context.json ? event_json(it->id, it->view)
                                 : "event " + event_text(it->id, it->view))
                << '\n';
  }
  context.out.flush();
  return model.events_seen();
}

}  // namespace

int monitor_text(Context& context, const MonitorOptions& options,
                 const std::function<bool()>& stopped) {
  Model model;
  const auto begin = Clock::now();
  const bool heard =
      wait_until(context, model, [&] { return !model.lines().empty() || stopped(); });
  if (!heard) {
    context.err << "no gateway was heard of\n";
    return kFailed;
  }
  std::uint64_t seen = options.once ? model.events_seen() : 0;
  auto next_picture = Clock::now();
  while (!stopped()) {
    seen = print_new_events(context, model, seen);
    if (Clock::now() >= next_picture) {
      picture(context, model);
      next_picture += kPicture;
    }
    const bool over =
        options.duration > Duration::zero() && Clock::now() - begin >= options.duration;
    if (options.once || over) {
      break;
    }
    poll(context, model, kPicturePoll);
  }
  return kDone;
}

}  // namespace linegate::console
