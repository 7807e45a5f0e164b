// SPDX-License-Identifier: Apache-2.0
#include "gateway/process/service_manager.h"

#include <cstdint>
#include <string>

#include <systemd/sd-daemon.h>

#include "gateway/runtime/clock.h"

namespace linegate::gateway {
namespace {

// A failure is ignored: the manager detects a silent service itself.
void notify(const std::string& message) {
  (void)sd_notify(0, message.c_str());
}

}  // namespace

Duration ServiceManager::watchdog() const {
  std::uint64_t microseconds = 0;
  if (sd_watchdog_enabled(0, &microseconds) <= 0) {
    return Duration::zero();
  }
  return std::chrono::microseconds(microseconds);
}

void ServiceManager::ready() {
  notify("READY=1");
}

void ServiceManager::reloading() {
  const auto now =
      std::chrono::duration_cast<std::chrono::microseconds>(monotonic_now().time_since_epoch());
  notify("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(now.count()));
}

void ServiceManager::stopping() {
  notify("STOPPING=1");
}

void ServiceManager::alive() {
  notify("WATCHDOG=1");
}

void ServiceManager::status(std::string_view text) {
  notify("STATUS=" + std::string(text));
}

}  // namespace linegate::gateway
