// SPDX-License-Identifier: Apache-2.0
// The monitor without a terminal or a clock: draws a model into cells, and handles keys.
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

  // Returns false if the user ends the program.
  bool handle(const Input& input, const Model& model);
  // Draws a screen of that size, cut at the bottom and at the right.
  Canvas draw(const Model& model, std::size_t rows, std::size_t columns, Instant utc);

  const Filter& filter() const { return filter_; }

 private:
  enum class Page : std::uint8_t { lines, nodes, values, events, node, help };
  static constexpr std::size_t kLists = 4;  // the pages before Page::node
  static constexpr std::size_t kUnsorted = static_cast<std::size_t>(-1);

  // A page and the position in it.
  struct Place {
    std::size_t sorted_by = kUnsorted;
    bool descending = false;
    std::size_t top = 0;     // first row shown
    std::size_t left = 0;    // characters scrolled out at the left
    std::size_t cursor = 0;  // selected row
    RowKey chosen;           // its key: the cursor follows it, except at the first row
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
  Page back_ = Page::nodes;  // the page from which a node page or help was opened
  std::array<Place, 6> places_;
  Directions directions_ = Directions::both;
  RowKey node_;                     // of Page::node
  std::vector<RowKey> keys_;        // rows of the last drawn page
  std::size_t room_ = 1;            // number of screen rows for them
  std::size_t text_rows_ = 0;       // rows of the last drawn Page::node or Page::help
  std::optional<Model> frozen_;     // shown instead of the live model
  std::optional<std::string> ask_;  // the filter while it is typed
  std::string message_;             // shown until the next key
};

}  // namespace linegate::console
