// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/monitor_view.h"

#include <algorithm>
#include <utility>

#include "bridges/console/monitor_pages.h"

namespace linegate::console {
namespace {

constexpr std::size_t kHead = 2;       // rows above the body
constexpr std::size_t kMostNotes = 4;  // rows of notes, so that the list keeps some
constexpr std::size_t kStep = 8;       // characters to scroll sideways

std::string plural(std::size_t count, const std::string& what) {
  return std::to_string(count) + ' ' + what + (count == 1 ? "" : "s");
}

std::string summary(const Model& model) {
  if (model.lines().empty()) {
    return "waiting for a gateway";
  }
  std::size_t operational = 0;
  std::size_t configured = 0;
  std::size_t stale = 0;
  for (const auto& [id, line] : model.lines()) {
    stale += model.freshness(line) == Freshness::live ? 0U : 1U;
    if (line.view) {
      operational += line.view->state.nodes_operational;
      configured += line.view->state.nodes_configured;
    }
  }
  return plural(model.lines().size(), "line") + ", " + std::to_string(operational) + " of " +
         plural(configured, "node") + " operational" +
         (stale == 0 ? "" : ", " + std::to_string(stale) + " not heard") + dropped_text(model);
}

}  // namespace

// --- keys ----------------------------------------------------------------------------------------

const RowKey* MonitorView::chosen() const {
  const std::size_t at = places_[static_cast<std::size_t>(page_)].cursor;
  return is_list() && at < keys_.size() ? &keys_[at] : nullptr;
}

bool MonitorView::handle(const Input& input, const Model& model) {
  if (input.key == Key::none || input.key == Key::resize) {
    return true;
  }
  message_.clear();
  if (ask_) {
    handle_prompt(input);
    return true;
  }
  switch (input.key) {
    case Key::character:
      return handle_character(input.character, model);
    case Key::enter:
      enter(model);
      break;
    case Key::escape:
    case Key::backspace:
      leave();
      break;
    case Key::tab:
      turn(true);
      break;
    case Key::back_tab:
      turn(false);
      break;
    default:
      move(input.key);
      break;
  }
  return true;
}

bool MonitorView::handle_character(char32_t character, const Model& model) {
  switch (character) {
    case U'q':
    case U'Q':
      return false;
    case U'1':
    case U'2':
    case U'3':
    case U'4':
      turn_to(static_cast<Page>(character - U'1'));
      break;
    case U'?':
    case U'h':
      if (page_ != Page::help) {
        back_ = page_;
        turn_to(Page::help);
      }
      break;
    case U'/':
      ask_ = text_of(filter_);
      break;
    case U's':
    case U'S':
      sort_by_next(character == U's');
      break;
    case U'r':
      place().descending = !place().descending;
      break;
    case U'l':
      next_line(model);
      break;
    case U'n':
      only_this_node(model);
      break;
    case U'o':
      directions_ = static_cast<Directions>((static_cast<unsigned>(directions_) + 1) % 3);
      break;
    case U'p':
    case U' ':
      freeze(model);
      break;
    case U'k':
      move(Key::up);
      break;
    case U'j':
      move(Key::down);
      break;
    case U'g':
      move(Key::home);
      break;
    case U'G':
      move(Key::end);
      break;
    default:
      break;
  }
  return true;
}

void MonitorView::handle_prompt(const Input& input) {
  switch (input.key) {
    case Key::character:
      if (input.character >= U' ' && input.character < 0x7F) {
        *ask_ += static_cast<char>(input.character);
      }
      break;
    case Key::backspace:
      if (!ask_->empty()) {
        ask_->pop_back();
      }
      break;
    case Key::escape:
      ask_.reset();
      break;
    case Key::enter:
      if (auto filter = parse_filter(*ask_)) {
        filter_ = *std::move(filter);
      } else {
        message_ = "no node-ID from 1 to 127: " + *ask_;
      }
      ask_.reset();
      break;
    default:
      break;
  }
}

void MonitorView::move(Key key) {
  Place& here = place();
  const std::size_t rows = is_list() ? keys_.size() : text_rows_;
  const std::size_t last =
      is_list() ? rows - std::min<std::size_t>(rows, 1) : rows - std::min(rows, room_);
  std::size_t& at = is_list() ? here.cursor : here.top;
  at = std::min(at, last);
  const std::size_t screen = std::max<std::size_t>(room_, 2) - 1;
  switch (key) {
    case Key::up:
      at -= std::min<std::size_t>(at, 1);
      break;
    case Key::down:
      at = std::min(at + 1, last);
      break;
    case Key::page_up:
      at -= std::min(at, screen);
      break;
    case Key::page_down:
      at = std::min(at + screen, last);
      break;
    case Key::home:
      at = 0;
      break;
    case Key::end:
      at = last;
      break;
    case Key::left:
      here.left -= std::min(here.left, kStep);
      break;
    case Key::right:
      here.left += kStep;
      break;
    default:
      break;
  }
  if (const RowKey* row = chosen()) {
    here.chosen = *row;
  }
}

void MonitorView::enter(const Model& model) {
  const RowKey* row = chosen();
  if (row == nullptr) {
    return;
  }
  if (page_ == Page::lines || row->node == 0) {
    filter_.line = reference_to(model, row->id);
    turn_to(Page::nodes);
    return;
  }
  node_ = *row;
  back_ = page_;
  turn_to(Page::node);
}

void MonitorView::leave() {
  if (is_list()) {
    filter_ = {};
  } else {
    turn_to(back_);
  }
}

void MonitorView::turn_to(Page page) {
  page_ = page;
  if (!is_list()) {
    place() = {};
  }
  keys_.clear();  // until the page is drawn
}

void MonitorView::turn(bool on) {
  const std::size_t at =
      is_list() ? static_cast<std::size_t>(page_) : static_cast<std::size_t>(back_);
  turn_to(static_cast<Page>((at + (on ? 1 : kLists - 1)) % kLists));
}

// Selects the next column and order in turn.
void MonitorView::sort_by_next(bool on) {
  if (!is_list()) {
    return;
  }
  const std::size_t columns = table_of(page_, {}).columns.size();
  std::size_t& by = place().sorted_by;
  const std::size_t now = by == kUnsorted ? columns : by;
  const std::size_t next = (now + (on ? 1 : columns)) % (columns + 1);
  by = next == columns ? kUnsorted : next;
}

void MonitorView::next_line(const Model& model) {
  const auto& lines = model.lines();
  const auto now = std::find_if(lines.begin(), lines.end(), [&](const auto& known) {
    return reference_to(model, known.first) == filter_.line;
  });
  const auto next = filter_.line.empty() || now == lines.end() ? lines.begin() : std::next(now);
  filter_.line = next == lines.end() ? "" : reference_to(model, next->first);
}

void MonitorView::only_this_node(const Model& model) {
  const RowKey* row = chosen();
  if (filter_.node != 0) {
    filter_.node = 0;
  } else if (row != nullptr && row->node != 0) {
    filter_.node = row->node;
    filter_.line = reference_to(model, row->id);
  }
}

void MonitorView::freeze(const Model& model) {
  if (frozen_) {
    frozen_.reset();
  } else {
    frozen_ = model;
  }
}

// --- picture -------------------------------------------------------------------------------------

Table MonitorView::table_of(Page page, const Model& model) const {
  switch (page) {
    case Page::nodes:
      return nodes_of(model, filter_);
    case Page::values:
      return values_of(model, filter_, directions_);
    case Page::events:
      return events_of(model, filter_);
    case Page::lines:
    case Page::node:
    case Page::help:
      break;
  }
  return lines_of(model, filter_);
}

Canvas MonitorView::draw(const Model& now, std::size_t rows, std::size_t columns, Instant utc) {
  const Model& model = frozen_ ? *frozen_ : now;
  Canvas canvas(rows, columns);
  draw_head(model, utc, canvas);
  room_ = rows > kHead + 1 ? rows - kHead - 1 : 1;
  if (page_ == Page::node) {
    draw_text(node_page(model, node_.id, node_.node, columns > 1 ? columns - 1 : 1), canvas);
  } else if (page_ == Page::help) {
    draw_text(help_page(), canvas);
  } else {
    draw_list(model, canvas);
  }
  draw_foot(canvas);
  return canvas;
}

void MonitorView::draw_head(const Model& model, Instant utc, Canvas& canvas) const {
  constexpr std::array<std::string_view, kLists> kTitles{" 1 Lines ", " 2 Nodes ", " 3 Values ",
                                                         " 4 Events "};
  canvas.fill(0, " linegate", Style::headline);
  std::size_t column = 11;
  for (std::size_t i = 0; i < kLists; ++i) {
    const bool here = static_cast<std::size_t>(page_) == i;
    canvas.put(0, column, kTitles[i], here ? Style::bold : Style::headline);
    column += kTitles[i].size();
  }
  canvas.put(0, column, " ? keys ", page_ == Page::help ? Style::bold : Style::headline);
  const std::string clock = clock_text(utc).substr(0, 8) + " UTC ";
  if (canvas.columns() >= column + 8 + clock.size()) {
    canvas.put(0, canvas.columns() - clock.size(), clock, Style::headline);
  }
  std::string text = ' ' + summary(model);
  if (!filter_.empty()) {
    text += "   only " + text_of(filter_);
  }
  if (page_ == Page::values && directions_ != Directions::both) {
    text += directions_ == Directions::inputs ? "   inputs" : "   outputs";
  }
  canvas.put(1, 0, text, model.lines().empty() ? Style::warning : Style::plain);
  if (frozen_) {
    constexpr std::string_view kHeld = " HELD ";
    canvas.put(1, canvas.columns() - std::min(canvas.columns(), kHeld.size()), kHeld,
               Style::selected);
  }
}

void MonitorView::draw_foot(Canvas& canvas) const {
  if (canvas.rows() == 0) {
    return;
  }
  const std::size_t row = canvas.rows() - 1;
  if (ask_) {
    canvas.fill(row, " filter (line=, node=, words): " + *ask_ + '_', Style::selected);
  } else if (!message_.empty()) {
    canvas.fill(row, ' ' + message_, Style::error);
  } else if (is_list()) {
    canvas.fill(row,
                " q quit  ? keys  Tab page  Enter open  / filter  l line  s sort  r turn  p hold",
                Style::headline);
  } else {
    canvas.fill(row, " q quit  Esc back  up/down scroll", Style::headline);
  }
}

// The cursor follows its row when rows move; at the first row it stays there.
void MonitorView::follow_cursor(const Table& table) {
  keys_.clear();
  for (const Row& row : table.rows) {
    keys_.push_back(row.key);
  }
  Place& here = place();
  if (here.cursor != 0) {
    const auto found = std::find(keys_.begin(), keys_.end(), here.chosen);
    if (found != keys_.end()) {
      here.cursor = static_cast<std::size_t>(found - keys_.begin());
    }
  }
  here.cursor = keys_.empty() ? 0 : std::min(here.cursor, keys_.size() - 1);
  if (!keys_.empty()) {
    here.chosen = keys_[here.cursor];
  }
}

void MonitorView::draw_list(const Model& model, Canvas& canvas) {
  Table table = table_of(page_, model);
  const Place& here = place();
  if (here.sorted_by != kUnsorted) {
    sort(table, here.sorted_by, here.descending);
    table.columns[here.sorted_by].title += here.descending ? '-' : '+';
  } else if (here.descending) {
    std::reverse(table.rows.begin(), table.rows.end());
  }
  follow_cursor(table);
  std::size_t row = kHead;
  for (std::size_t i = 0; i < table.notes.size(); ++i) {
    if (i + 1 == kMostNotes && table.notes.size() > kMostNotes) {
      canvas.put(row++, 1, "... and " + std::to_string(table.notes.size() - i) + " more",
                 table.notes[i].style);
      break;
    }
    canvas.put(row++, 1, table.notes[i].text, table.notes[i].style);
  }
  draw_rows(table, row, canvas);
  if (page_ == Page::lines && here.top == 0) {
    draw_newest_events(model, row + 1 + table.rows.size(), canvas);
  }
}

void MonitorView::draw_rows(const Table& table, std::size_t from, Canvas& canvas) {
  Place& here = place();
  const std::size_t end = canvas.rows() - std::min<std::size_t>(canvas.rows(), 1);
  room_ = end > from + 1 ? end - from - 1 : 1;
  here.top = std::min(here.top, here.cursor);
  here.top = std::max(here.top, here.cursor + 1 - std::min(here.cursor + 1, room_));
  const std::size_t width = canvas.columns() > 1 ? canvas.columns() - 1 : 1;
  const Text text = fit(table, width, here.left);
  canvas.fill(from, ' ' + text.front(), Style::headline);
  for (std::size_t i = 0; i < room_ && here.top + i < table.rows.size(); ++i) {
    const std::size_t at = here.top + i;
    if (at == here.cursor) {
      canvas.fill(from + 1 + i, '>' + text[at + 1], Style::selected);
    } else {
      canvas.put(from + 1 + i, 1, text[at + 1], table.rows[at].style);
    }
  }
  if (table.rows.empty() && table.notes.empty()) {
    canvas.put(from + 1, 1,
               filter_.empty() ? "nothing yet"
                               : "nothing that " + text_of(filter_) + " would show; Esc shows all");
  }
}

void MonitorView::draw_newest_events(const Model& model, std::size_t from, Canvas& canvas) const {
  if (model.lines().empty() || canvas.rows() < from + 4) {
    return;
  }
  const Table table = events_of(model, {.line = filter_.line}, canvas.rows() - from - 3);
  const Text text = fit(table, canvas.columns() > 1 ? canvas.columns() - 1 : 1, 0);
  canvas.put(from + 1, 1, "the newest events", Style::bold);
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    canvas.put(from + 2 + i, 1, text[i + 1], table.rows[i].style);
  }
}

void MonitorView::draw_text(const std::vector<Note>& lines, Canvas& canvas) {
  Place& here = place();
  text_rows_ = lines.size();
  here.top = std::min(here.top, lines.size() - std::min(lines.size(), room_));
  for (std::size_t i = 0; i < room_ && here.top + i < lines.size(); ++i) {
    const Note& line = lines[here.top + i];
    const std::string text(cut(line.text, here.left, canvas.columns()));
    if (line.style == Style::headline) {
      canvas.fill(kHead + i, ' ' + text, line.style);
    } else {
      canvas.put(kHead + i, 1, text, line.style);
    }
  }
}

}  // namespace linegate::console
