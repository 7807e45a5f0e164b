// SPDX-License-Identifier: Apache-2.0
// Executes long work, such as reading files, in another thread, while the calling thread continues.
#pragma once

#include <functional>
#include <future>
#include <optional>

#include "stack/base/time.h"

namespace linegate::gateway {

class Background {
 public:
  // The part of the work that the thread that called start() executes at the end.
  using Rest = std::function<void()>;

  // Executes the work in its own thread. If it is still running when this object is destroyed, it
  // is abandoned without waiting: the work must own everything it uses, and must not throw.
  // Precondition: not active().
  void start(std::function<Rest()> work);

  bool active() const { return result_.valid(); }
  // Returns the rest when the work is done; waits for it at most `patience`.
  std::optional<Rest> finished(Duration patience = {});

 private:
  std::future<Rest> result_;
};

}  // namespace linegate::gateway
