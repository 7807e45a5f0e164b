// SPDX-License-Identifier: Apache-2.0
#include <chrono>

#include "bridges/console/lookup.h"
#include "bridges/console/monitor.h"
#include "bridges/console/monitor_view.h"
#include "bridges/console/screen.h"

namespace linegate::console {
namespace {

constexpr Duration kWait = std::chrono::milliseconds(25);    // wait for samples between two keys
constexpr Duration kFrame = std::chrono::milliseconds(200);  // shortest time between two screens
constexpr Duration kStill = std::chrono::seconds(1);  // redraw at least this often, for the clock

// Handles all pending keys. Returns false to end.
bool handle_keys(Screen& screen, MonitorView& view, const Model& model, bool& typed) {
  for (Input input = screen.input(); input.key != Key::none; input = screen.input()) {
    typed = true;
    if (!view.handle(input, model)) {
      return false;
    }
  }
  return true;
}

}  // namespace

int monitor_screen(Context& context, const MonitorOptions& options, Model& model,
                   const std::function<bool()>& stopped) {
  Screen screen;
  if (!screen.ok()) {
    MonitorOptions text = options;
    text.once = options.duration <= Duration::zero();
    return monitor_text(context, text, model, stopped);
  }
  MonitorView view(options.filter);
  const Instant begin = steady_now();
  Instant drawn{};
  std::uint64_t revision = 0;
  while (!stopped()) {
    bool typed = false;
    if (!handle_keys(screen, view, model, typed)) {
      break;
    }
    const Instant now = steady_now();
    model.at(now);
    const bool news = model.revision() != revision && now - drawn >= kFrame;
    if (typed || news || now - drawn >= kStill) {
      screen.show(view.draw(model, screen.rows(), screen.columns(), utc_now()));
      drawn = now;
      revision = model.revision();
    }
    if (options.duration > Duration::zero() && now - begin >= options.duration) {
      break;
    }
    context.client.poll(kWait, model);
  }
  return kDone;
}

}  // namespace linegate::console
