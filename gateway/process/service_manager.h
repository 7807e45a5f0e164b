// SPDX-License-Identifier: Apache-2.0
// What the service manager is told: systemd, by sd_notify(3). Where none started this process,
// nothing is sent.
#pragma once

#include <string_view>

#include "stack/base/time.h"

namespace linegate::gateway {

class ServiceManager {
 public:
  // It ends the service if it hears alive() less often than that; 0 = it does not watch.
  // WATCHDOG_USEC, if it is meant for this process.
  Duration watchdog() const;

  void ready();
  void reloading();  // until the next ready()
  void stopping();
  void alive();
  // One line for people, as `systemctl status` shows it.
  void status(std::string_view text);
};

}  // namespace linegate::gateway
