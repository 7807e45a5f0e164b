// SPDX-License-Identifier: Apache-2.0
// Notifications to the service manager (systemd, sd_notify(3)). Without one, nothing is sent.
#pragma once

#include <string_view>

#include "stack/base/time.h"

namespace linegate::gateway {

class ServiceManager {
 public:
  // The longest permitted time between two alive(), after which the manager ends the service; 0 =
  // no watchdog. WATCHDOG_USEC, if WATCHDOG_PID is this process.
  Duration watchdog() const;

  void ready();
  void reloading();  // until the next ready()
  void stopping();
  void alive();
  // One line of text, as shown by `systemctl status`.
  void status(std::string_view text);
};

}  // namespace linegate::gateway
