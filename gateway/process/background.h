// SPDX-License-Identifier: Apache-2.0
// Work that may take long, such as reading files, beside a thread that goes on meanwhile.
#pragma once

#include <functional>
#include <future>
#include <optional>

#include "stack/base/time.h"

namespace linegate::gateway {

class Background {
 public:
  // What is left to do by the thread that called start().
  using Rest = std::function<void()>;

  // Has a thread of its own do the work. It is given up, not waited for, if it is under way when
  // this ends: the work must own all it uses, and must not throw. Precondition: not active().
  void start(std::function<Rest()> work);

  bool active() const { return result_.valid(); }
  // The rest, once the work is done; waits for it at most that long.
  std::optional<Rest> finished(Duration patience = {});

 private:
  std::future<Rest> result_;
};

}  // namespace linegate::gateway
