// SPDX-License-Identifier: Apache-2.0
// Runs a gateway as a service: reports readiness, sends watchdog notifications while the threads
// respond, and stops in an orderly way.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "gateway/process/background.h"
#include "gateway/process/gateway.h"
#include "gateway/process/progress_watch.h"
#include "gateway/process/service_manager.h"

namespace linegate::gateway {

class Service {
 public:
  // reload: the action for SIGHUP. It reads files in its own thread, which is abandoned if the
  // service ends meanwhile; the function that it returns is called by the thread that runs the
  // service. gateway must be usable until run() ends, reload must own everything it uses.
  Service(Gateway& gateway, std::function<Background::Rest()> reload);

  // Starts the gateway, stops it after SIGINT or SIGTERM, and returns the number of the signal.
  // Both must be blocked already.
  int run();

 private:
  // Waits until the next work is due, or for a signal. Returns the signal that ends the service, 0
  // = none.
  int wait();
  void work(Instant now);
  void begin_reload(const std::optional<SignalSender>& sender);
  void finish_reload();
  void apply_scans();
  void look();
  void show_status();

  Gateway& gateway_;
  std::function<Background::Rest()> reload_;
  Background reading_;
  bool read_again_ = false;                  // SIGHUP was received while files were read
  std::optional<SignalSender> next_sender_;  // its sender
  ServiceManager manager_;
  Duration look_period_;
  ProgressWatch watch_;
  bool ready_ = false;
  Instant look_due_{};
  Instant status_due_{};
  std::vector<std::string> stuck_;
  std::string status_;
};

}  // namespace linegate::gateway
