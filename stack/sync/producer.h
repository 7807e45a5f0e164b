// SPDX-License-Identifier: Apache-2.0
// The SYNC producer (CiA 301, 7.2.5): a frame without data, or with the counter in its one byte.
#pragma once

#include <cstdint>
#include <optional>

#include "stack/base/time.h"
#include "stack/can/transmit_queue.h"
#include "stack/sync/parameters.h"

namespace linegate::sync {

class Producer {
 public:
  // transmit must outlive the producer.
  explicit Producer(can::TransmitQueue& transmit);

  // Starts anew, or stops: the first SYNC comes one period after the next settle() or advance().
  void configure(const Parameters& parameters);
  // Off in Stopped and Initialising. Switching it on starts anew, with counter 1.
  void set_active(bool active);

  // Starts the clock after a change; sends nothing.
  void settle(Instant now);
  // Queues a SYNC if one is due and gives its counter (0 = without). The period does not drift; a
  // producer called too late leaves out what it missed, and no second SYNC is queued behind one
  // that still waits for the bus.
  std::optional<std::uint8_t> advance(Instant now);
  // A time in the past (Instant{}) after a change: settle() or advance() is wanted at once.
  Instant next_wake() const { return next_; }

 private:
  void restart();
  std::uint8_t take_counter();

  can::TransmitQueue& transmit_;
  Parameters parameters_;
  bool active_ = false;
  bool anchored_ = true;  // next_ is a time, not the wish for one
  Instant next_ = kNever;
  std::uint8_t counter_ = 1;
};

}  // namespace linegate::sync
