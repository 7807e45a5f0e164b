// SPDX-License-Identifier: Apache-2.0
#include "gateway/process/background.h"

#include <thread>
#include <utility>

#include "stack/base/assert.h"

namespace linegate::gateway {

// The destructor of a packaged_task's future does not wait.
void Background::start(std::function<Rest()> work) {
  LINEGATE_ASSERT(!active(), "the work before has ended");
  std::packaged_task<Rest()> task(std::move(work));
  result_ = task.get_future();
  std::thread(std::move(task)).detach();
}

std::optional<Background::Rest> Background::finished(Duration patience) {
  if (!active() || result_.wait_for(patience) != std::future_status::ready) {
    return std::nullopt;
  }
  return result_.get();
}

}  // namespace linegate::gateway
