#include "bridges/console/screen.h"

#include <algorithm>
#include <cstdio>
#include <string>

#include <ncurses.h>

namespace linegate::console {
namespace {

attr_t attribute(Style style) {
  switch (style) {
    case Style::plain:
      return A_NORMAL;
    case Style::headline:
      return A_REVERSE;
    case Style::bold:
      return A_BOLD;
    case Style::good:
      return static_cast<attr_t>(COLOR_PAIR(1));
    case Style::warning:
      return static_cast<attr_t>(COLOR_PAIR(2));
    case Style::error:
      return static_cast<attr_t>(COLOR_PAIR(3)) | A_BOLD;
    case Style::changed:
      return static_cast<attr_t>(COLOR_PAIR(4)) | A_BOLD;
  }
  return A_NORMAL;
}

}  // namespace

Screen::Screen() {
  SCREEN* const screen = newterm(nullptr, stdout, stdin);
  if (screen == nullptr) {
    return;
  }
  screen_ = screen;
  window_ = stdscr;
  cbreak();
  noecho();
  nodelay(stdscr, TRUE);
  keypad(stdscr, TRUE);
  curs_set(0);
  if (has_colors()) {
    start_color();
    use_default_colors();
    init_pair(1, COLOR_GREEN, -1);
    init_pair(2, COLOR_YELLOW, -1);
    init_pair(3, COLOR_RED, -1);
    init_pair(4, COLOR_CYAN, -1);
  }
}

Screen::~Screen() {
  if (screen_ != nullptr) {
    endwin();
    delscreen(static_cast<SCREEN*>(screen_));
  }
}

int Screen::rows() const {
  return getmaxy(stdscr);
}
int Screen::columns() const {
  return getmaxx(stdscr);
}

void Screen::begin() {
  erase();
}
void Screen::end() {
  refresh();
}

void Screen::put(int row, int column, std::string_view text, Style style) {
  if (row < 0 || row >= rows() || column < 0 || column >= columns()) {
    return;
  }
  const int room = columns() - column;
  attrset(static_cast<int>(attribute(style)));
  mvaddnstr(row, column, text.data(), std::min(room, static_cast<int>(text.size())));
  attrset(static_cast<int>(A_NORMAL));
}

void Screen::fill(int row, std::string_view text, Style style) {
  std::string whole(text);
  whole.resize(static_cast<std::size_t>(std::max(columns(), 0)), ' ');
  put(row, 0, whole, style);
}

Key Screen::key() {
  switch (getch()) {
    case 'q':
    case 'Q':
    case 3:
      return Key::quit;
    case '\t':
    case KEY_RIGHT:
      return Key::next_line;
    case KEY_BTAB:
    case KEY_LEFT:
      return Key::previous_line;
    case KEY_UP:
    case 'k':
      return Key::up;
    case KEY_DOWN:
    case 'j':
      return Key::down;
    case KEY_PPAGE:
      return Key::page_up;
    case KEY_NPAGE:
      return Key::page_down;
    case 'o':
      return Key::direction;
    default:
      return Key::none;
  }
}

}  // namespace linegate::console
