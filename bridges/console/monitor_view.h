// SPDX-License-Identifier: Apache-2.0
// What the monitor shows, and what keys do to it: from a model to cells. Nothing here knows a
// terminal or a clock.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bridges/console/canvas.h"
#include "bridges/console/filter.h"
#include "bridges/console/tables.h"

namespace linegate::console {

enum class Key : std::uint8_t {
  none,
  character,
  up,
  down,
  left,
  right,
  page_up,
  page_down,
  home,
  end,
  enter,
  escape,
  backspace,
  tab,
  back_tab,
  resize,
};

struct Input {
  Key key = Key::none;
  char32_t character = 0;  // of Key::character
};

class MonitorView {
 public:
  explicit MonitorView(Filter filter = {}) : filter_(std::move(filter)) {}

  // False: the person at the keyboard wants to end.
  bool handle(const Input& input, const Model& model);
  // A screen of that size. What does not find room is cut, below or at the right.
  Canvas draw(const Model& model, std::size_t rows, std::size_t columns, Instant utc);

  const Filter& filter() const { return filter_; }

 private:
  enum class Page : std::uint8_t { lines, nodes, values, events, node, help };
  static constexpr std::size_t kLists = 4;  // the pages ahead of Page::node
  static constexpr std::size_t kUnsorted = static_cast<std::size_t>(-1);

  // A page and where one is in it.
  struct Place {
    std::size_t sorted_by = kUnsorted;
    bool descending = false;
    std::size_t top = 0;     // first row shown
    std::size_t left = 0;    // characters left out
    std::size_t cursor = 0;  // row chosen
    RowKey chosen;           // what it is about: the cursor stays with it, but at the first row
  };

  Place& place() { return places_[static_cast<std::size_t>(page_)]; }
  bool is_list() const { return static_cast<std::size_t>(page_) < kLists; }
  const RowKey* chosen() const;

  bool handle_character(char32_t character, const Model& model);
  void handle_prompt(const Input& input);
  void move(Key key);
  void enter(const Model& model);
  void leave();
  void turn_to(Page page);
  void turn(bool on);
  void sort_by_next(bool on);
  void next_line(const Model& model);
  void only_this_node(const Model& model);
  void freeze(const Model& model);

  Table table_of(Page page, const Model& model) const;
  void draw_head(const Model& model, Instant utc, Canvas& canvas) const;
  void draw_foot(Canvas& canvas) const;
  void draw_list(const Model& model, Canvas& canvas);
  void draw_rows(const Table& table, std::size_t from, Canvas& canvas);
  void draw_newest_events(const Model& model, std::size_t from, Canvas& canvas) const;
  void draw_text(const std::vector<Note>& lines, Canvas& canvas);
  void follow_cursor(const Table& table);

  Filter filter_;
  Page page_ = Page::lines;
  Page back_ = Page::nodes;  // where the page of a node, or help, was called from
  std::array<Place, 6> places_;
  Directions directions_ = Directions::both;
  RowKey node_;                     // of Page::node
  std::vector<RowKey> keys_;        // rows of the page as drawn last
  std::size_t room_ = 1;            // rows for them
  std::size_t text_rows_ = 0;       // of Page::node and Page::help as drawn last
  std::optional<Model> frozen_;     // shown instead of what goes on
  std::optional<std::string> ask_;  // the filter being typed
  std::string message_;             // until the next key
};

}  // namespace linegate::console
