// SPDX-License-Identifier: Apache-2.0
// A unit that an executor runs on its thread: a line, or simulated devices, on a channel.
#pragma once

#include "gateway/exchange/wakeup.h"
#include "stack/base/time.h"

namespace linegate::gateway {

class Runner {
 public:
  virtual ~Runner() = default;

  // Pollable, or -1 if there is none at present; called again after each service().
  virtual int descriptor() const = 0;
  virtual bool wants_writable() const = 0;

  // Does all work that is due. Called when the descriptor is ready, next_wake() has come, or the
  // executor was woken.
  virtual void service(Instant now) = 0;
  // The executor has just found that the descriptor is not ready. Called before service(), which
  // need not read it, unless something is due that must not be before the frames received earlier.
  virtual void nothing_to_read() {}
  // Whether a line of another executor has left values for this runner: then service() is called.
  // Called when such a line has woken the executor.
  virtual bool has_values() const { return false; }
  // The executor was woken: another thread may have left data for this runner. Called before
  // service(), which need not check the rings of other threads otherwise.
  virtual void called() {}
  // Called after service(), when every runner of the round has had its turn: wakes the threads for
  // which data was left. Earlier, they would take the processor from runners that wait. Returns the
  // wake-up of a consumer that other runners may share, or nullptr: the executor signals it once
  // for all of them. A consumer on the same processor would otherwise run between two signals.
  virtual exchange::Wakeup* announce() { return nullptr; }
  virtual Instant next_wake() const = 0;

  // Begins an orderly stop; service() is called until stopped() returns true.
  virtual void stop(Instant now) = 0;
  virtual bool stopped(Instant now) const = 0;
};

}  // namespace linegate::gateway
