// SPDX-License-Identifier: Apache-2.0
// Runs a gateway as a service: ready when it is, a sign of life while its threads go round, in good
// order to the end.
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
  // reload: what SIGHUP does. It reads files, and is called by a thread of its own, which is given
  // up if the service ends meanwhile; what it gives is called by the thread that runs the service.
  // gateway must be usable until run() ends, reload must own all it uses.
  Service(Gateway& gateway, std::function<Background::Rest()> reload);

  // Starts the gateway, ends it after SIGINT or SIGTERM, and gives the number of the signal. Both
  // must be blocked already.
  int run();

 private:
  // Until the next thing is due, or a signal comes. Gives the one that ends the service, 0 = none.
  int wait();
  void work(Instant now);
  void begin_reload();
  void finish_reload();
  void take_scans();
  void look();
  void show_status();

  Gateway& gateway_;
  std::function<Background::Rest()> reload_;
  Background reading_;
  bool read_again_ = false;  // a SIGHUP came while files were read
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
