// The terminal as a place to draw on (ncurses), put back in order when it goes out of scope.
#pragma once

#include <cstddef>
#include <string_view>

namespace linegate::console {

enum class Style { plain, headline, bold, good, warning, error, changed };

enum class Key { none, quit, next_line, previous_line, up, down, page_up, page_down, direction };

class Screen {
 public:
  // Precondition: standard output is a terminal. ok() is false where it cannot be used (TERM).
  Screen();
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  bool ok() const { return window_ != nullptr; }
  // Follow the terminal when it is resized.
  int rows() const;
  int columns() const;

  void begin();
  // Cut at the right border; nothing happens outside of the screen.
  void put(int row, int column, std::string_view text, Style style = Style::plain);
  // One row from border to border.
  void fill(int row, std::string_view text, Style style);
  void end();

  // Does not wait.
  Key key();

 private:
  void* screen_ = nullptr;
  void* window_ = nullptr;
};

}  // namespace linegate::console
