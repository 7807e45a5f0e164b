// SPDX-License-Identifier: Apache-2.0
// Something an executor runs on its thread: a line, or simulated devices, on a channel.
#pragma once

#include "stack/base/time.h"

namespace linegate::gateway {

class Runner {
 public:
  virtual ~Runner() = default;

  // Pollable, or -1 while there is none; asked again after each service().
  virtual int descriptor() const = 0;
  virtual bool wants_writable() const = 0;

  // Does everything there is to do. Called when the descriptor is ready, next_wake() has come, or
  // the executor was woken.
  virtual void service(Instant now) = 0;
  // The executor was woken: another thread may have left something for this runner. Before
  // service(), which need not look into what other threads write as long as nobody calls.
  virtual void called() {}
  // After service(), when every runner of the round had its turn: wakes the threads for which
  // something was left. Before that they would take the processor from runners that wait.
  virtual void announce() {}
  virtual Instant next_wake() const = 0;

  // Begins to stop in good order; service() goes on until stopped() is true.
  virtual void stop(Instant now) = 0;
  virtual bool stopped(Instant now) const = 0;
};

}  // namespace linegate::gateway
