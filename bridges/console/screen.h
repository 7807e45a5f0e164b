// SPDX-License-Identifier: Apache-2.0
// The terminal (ncurses): shows a canvas and reads keys. The destructor restores it.
#pragma once

#include <cstddef>

#include "bridges/console/canvas.h"
#include "bridges/console/monitor_view.h"

namespace linegate::console {

class Screen {
 public:
  // Precondition: standard output is a terminal. ok() is false if it cannot be used: TERM is
  // unknown, or its terminal cannot position the cursor.
  Screen();
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  bool ok() const { return screen_ != nullptr; }
  // Updated after Key::resize was returned.
  std::size_t rows() const;
  std::size_t columns() const;

  void show(const Canvas& canvas);
  // Does not block: Key::none if no key was pressed.
  Input input();

 private:
  void* screen_ = nullptr;
};

}  // namespace linegate::console
