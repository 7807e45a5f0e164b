// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/screen.h"

#include <algorithm>
#include <array>
#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <string>

#define NCURSES_WIDECHAR 1
#include <ncurses.h>
#include <unistd.h>

#include "stack/base/assert.h"

// Declared here because ncurses' term.h defines common words such as "lines" and "columns" as
// macros.
extern "C" char* tigetstr(const char* capability);

namespace linegate::console {
namespace {

constexpr int kEscapeDelay = 50;  // ms within which the rest of an escape sequence must arrive

attr_t attribute_of(Style style) {
  switch (style) {
    case Style::plain:
      return A_NORMAL;
    case Style::headline:
      return A_REVERSE;
    case Style::selected:
      return A_REVERSE | A_BOLD;
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
    case Style::stale:
      return A_DIM;
  }
  return A_NORMAL;
}

void set_up_colours() {
  if (has_colors()) {
    start_color();
    use_default_colors();
    init_pair(1, COLOR_GREEN, -1);
    init_pair(2, COLOR_YELLOW, -1);
    init_pair(3, COLOR_RED, -1);
    init_pair(4, COLOR_CYAN, -1);
  }
}

bool can_place_cursor() {
  const char* const sequence = tigetstr("cup");
  return sequence != nullptr && sequence != reinterpret_cast<const char*>(-1);
}

Key key_of(wint_t code) {
  switch (code) {
    case KEY_UP:
      return Key::up;
    case KEY_DOWN:
      return Key::down;
    case KEY_LEFT:
      return Key::left;
    case KEY_RIGHT:
      return Key::right;
    case KEY_PPAGE:
      return Key::page_up;
    case KEY_NPAGE:
      return Key::page_down;
    case KEY_HOME:
      return Key::home;
    case KEY_END:
      return Key::end;
    case KEY_ENTER:
      return Key::enter;
    case KEY_BACKSPACE:
      return Key::backspace;
    case KEY_BTAB:
      return Key::back_tab;
    case KEY_RESIZE:
      return Key::resize;
    default:
      return Key::none;
  }
}

Input character_input(wint_t code) {
  switch (code) {
    case L'\r':
    case L'\n':
      return {Key::enter};
    case L'\t':
      return {Key::tab};
    case 27:
      return {Key::escape};
    case 8:
    case 127:
      return {Key::backspace};
    default:
      return {Key::character, static_cast<char32_t>(code)};
  }
}

}  // namespace

Screen::Screen() {
  LINEGATE_ASSERT(isatty(STDOUT_FILENO) != 0, "standard output is a terminal");
  std::setlocale(LC_CTYPE, "");
  SCREEN* const screen = newterm(nullptr, stdout, stdin);
  if (screen == nullptr) {
    return;
  }
  if (!can_place_cursor()) {
    endwin();
    delscreen(screen);
    return;
  }
  screen_ = screen;
  cbreak();
  noecho();
  nodelay(stdscr, TRUE);
  keypad(stdscr, TRUE);
  set_escdelay(kEscapeDelay);
  curs_set(0);
  set_up_colours();
}

Screen::~Screen() {
  if (screen_ != nullptr) {
    endwin();
    delscreen(static_cast<SCREEN*>(screen_));
  }
}

std::size_t Screen::rows() const {
  return static_cast<std::size_t>(std::max(getmaxy(stdscr), 0));
}
std::size_t Screen::columns() const {
  return static_cast<std::size_t>(std::max(getmaxx(stdscr), 0));
}

void Screen::show(const Canvas& canvas) {
  // The character set of the terminal may lack these characters.
  const bool ascii = MB_CUR_MAX == 1;
  erase();
  std::wstring run;
  for (std::size_t row = 0; row < canvas.rows(); ++row) {
    for (std::size_t column = 0; column < canvas.columns();) {
      const Style style = canvas.at(row, column).style;
      const std::size_t begin = column;
      run.clear();
      for (; column < canvas.columns() && canvas.at(row, column).style == style; ++column) {
        const char32_t c = canvas.at(row, column).character;
        run += ascii && c > U'~' ? L'?' : static_cast<wchar_t>(c);
      }
      attrset(static_cast<int>(attribute_of(style)));
      mvaddnwstr(static_cast<int>(row), static_cast<int>(begin), run.data(),
                 static_cast<int>(run.size()));
    }
  }
  attrset(static_cast<int>(A_NORMAL));
  refresh();
}

Input Screen::input() {
  for (;;) {
    wint_t code = 0;
    const int kind = get_wch(&code);
    if (kind == ERR) {
      return {};
    }
    if (kind != KEY_CODE_YES) {
      return character_input(code);
    }
    if (const Key key = key_of(code); key != Key::none) {
      return {key};
    }
  }
}

}  // namespace linegate::console
