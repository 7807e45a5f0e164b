// SPDX-License-Identifier: Apache-2.0
// The terminal (ncurses): shows what was drawn and tells what was typed. It is put back in order
// when this goes out of scope.
#pragma once

#include <cstddef>

#include "bridges/console/canvas.h"
#include "bridges/console/monitor_view.h"

namespace linegate::console {

class Screen {
 public:
  // Precondition: standard output is a terminal. ok() is false where it cannot be used: TERM is
  // not known, or names one without a cursor that can be placed.
  Screen();
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  bool ok() const { return screen_ != nullptr; }
  // Follow the terminal when it is resized, once Key::resize was given.
  std::size_t rows() const;
  std::size_t columns() const;

  void show(const Canvas& canvas);
  // Does not wait: Key::none if nothing was typed.
  Input input();

 private:
  void* screen_ = nullptr;
};

}  // namespace linegate::console
