#include <algorithm>
#include <chrono>
#include <ostream>

#include "bridges/console/monitor.h"
#include "bridges/console/screen.h"
#include "bridges/console/tables.h"

namespace linegate::console {
namespace {

using Clock = std::chrono::steady_clock;

constexpr Duration kFrame = std::chrono::milliseconds(100);
constexpr int kEventRows = 6;

// What the person at the keyboard has chosen.
struct View {
  std::size_t line = 0;  // position in Model::lines()
  int scroll = 0;
  image::Direction direction = image::Direction::inputs;
};

Style style_of(const LineView& line) {
  switch (line.state.bus) {
    case can::BusState::error_active:
    case can::BusState::unknown:
      return Style::plain;
    case can::BusState::error_warning:
    case can::BusState::error_passive:
      return Style::warning;
    case can::BusState::bus_off:
    case can::BusState::stopped:
    case can::BusState::absent:
      return Style::error;
  }
  return Style::plain;
}

Style style_of(const NodeView& node) {
  if (node.state.presence == line::Presence::missing) {
    return Style::error;
  }
  return node.state.state == nmt::State::operational ? Style::good : Style::warning;
}

Style style_of(EventSeverity severity) {
  switch (severity) {
    case EventSeverity::info:
      return Style::plain;
    case EventSeverity::warning:
      return Style::warning;
    case EventSeverity::error:
      return Style::error;
  }
  return Style::plain;
}

class Monitor {
 public:
  Monitor(Screen& screen, const Model& model) : screen_(screen), model_(model) {}

  void handle(Key key) {
    const std::size_t lines = std::max<std::size_t>(model_.lines().size(), 1);
    switch (key) {
      case Key::next_line:
        view_ = {.line = (view_.line + 1) % lines, .direction = view_.direction};
        break;
      case Key::previous_line:
        view_ = {.line = (view_.line + lines - 1) % lines, .direction = view_.direction};
        break;
      case Key::up:
        view_.scroll = std::max(view_.scroll - 1, 0);
        break;
      case Key::down:
        ++view_.scroll;
        break;
      case Key::page_up:
        view_.scroll = std::max(view_.scroll - 10, 0);
        break;
      case Key::page_down:
        view_.scroll += 10;
        break;
      case Key::direction:
        view_.direction = view_.direction == image::Direction::inputs ? image::Direction::outputs
                                                                      : image::Direction::inputs;
        view_.scroll = 0;
        break;
      case Key::none:
      case Key::quit:
        break;
    }
  }

  void draw() {
    screen_.begin();
    row_ = 0;
    draw_lines();
    draw_nodes();
    draw_image(screen_.rows() - kEventRows - 2);
    draw_events(screen_.rows() - kEventRows - 1);
    screen_.fill(screen_.rows() - 1,
                 " q quit   Tab line   up/down scroll   o inputs/outputs" + dropped_text(model_),
                 Style::headline);
    screen_.end();
  }

 private:
  const Line* chosen() const {
    if (model_.lines().empty()) {
      return nullptr;
    }
    const std::size_t position = std::min(view_.line, model_.lines().size() - 1);
    return &std::next(model_.lines().begin(), static_cast<std::ptrdiff_t>(position))->second;
  }

  void draw_lines() {
    const Text text = lines_table(model_);
    screen_.fill(row_++, ' ' + text.front(), Style::headline);
    std::size_t i = 1;
    for (const auto& [id, line] : model_.lines()) {
      const bool is_chosen = &line == chosen();
      screen_.put(row_, 0, is_chosen ? ">" : " ", Style::bold);
      screen_.put(row_++, 1, text[i++],
                  line.gone   ? Style::error
                  : line.view ? style_of(*line.view)
                              : Style::plain);
    }
    if (model_.lines().empty()) {
      screen_.put(row_++, 1, "waiting for a gateway", Style::warning);
    }
  }

  // At most a third of the screen; the rest is counted.
  void draw_nodes() {
    const Line* line = chosen();
    if (line == nullptr) {
      return;
    }
    const Text text = nodes_table({line});
    screen_.fill(row_++, ' ' + text.front(), Style::headline);
    const auto room = static_cast<std::size_t>(std::max(screen_.rows() / 3 - 1, 2));
    std::size_t shown = 0;
    for (const auto& [id, node] : line->nodes) {
      if (shown == room) {
        screen_.put(row_++, 1, "... and " + std::to_string(line->nodes.size() - shown) + " more");
        break;
      }
      screen_.put(row_++, 1, text[++shown], style_of(node));
    }
  }

  void draw_image(int end) {
    const Line* line = chosen();
    if (line == nullptr || row_ >= end) {
      return;
    }
    const Text text = image_table(*line, view_.direction);
    const Area& area = line->areas[static_cast<std::size_t>(view_.direction)];
    screen_.fill(row_++,
                 ' ' + line->id.line + ' ' + std::string(image::name(view_.direction)) +
                     (area.image ? " #" + std::to_string(area.image->sequence) : ""),
                 Style::headline);
    const int last = std::max(static_cast<int>(text.size()) - (end - row_), 0);
    view_.scroll = std::min(view_.scroll, last);
    for (int i = view_.scroll; i < static_cast<int>(text.size()) && row_ < end; ++i) {
      const bool changed =
          i > 0 && area.complete() && area.image->is_changed(static_cast<std::size_t>(i - 1));
      screen_.put(row_++, 1, text[static_cast<std::size_t>(i)],
                  i == 0    ? Style::bold
                  : changed ? Style::changed
                            : Style::plain);
    }
  }

  void draw_events(int from) {
    screen_.fill(from - 1, " EVENTS of all lines", Style::headline);
    const auto& events = model_.events();
    const std::size_t count = std::min<std::size_t>(events.size(), kEventRows);
    int row = from;
    for (auto it = events.end() - static_cast<std::ptrdiff_t>(count); it != events.end(); ++it) {
      screen_.put(row++, 1, event_text(it->id, it->view), style_of(severity(it->view.event.kind)));
    }
  }

  Screen& screen_;
  const Model& model_;
  View view_;
  int row_ = 0;
};

}  // namespace

int monitor_screen(Context& context, const MonitorOptions& options,
                   const std::function<bool()>& stopped) {
  Model model;
  Screen screen;
  if (!screen.ok()) {
    return monitor_text(context, options, stopped);
  }
  Monitor monitor(screen, model);
  const auto begin = Clock::now();
  auto next_frame = begin;
  while (!stopped()) {
    const Key key = screen.key();
    if (key == Key::quit) {
      break;
    }
    monitor.handle(key);
    context.client.poll(kFrame / 4, model);
    const auto now = Clock::now();
    if (key != Key::none || now >= next_frame) {
      monitor.draw();
      next_frame = now + kFrame;
    }
    if (options.duration > Duration::zero() && now - begin >= options.duration) {
      break;
    }
  }
  return kDone;
}

}  // namespace linegate::console
