// SPDX-License-Identifier: Apache-2.0
// The SYNC producer (CiA 301, 7.2.5): sends a frame without data, or with the counter in one byte.
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

  // Restarts, or stops: the first SYNC is due one period after the next apply_writes() or
  // advance().
  void configure(const Parameters& parameters);
  // False in Stopped and Initialising. A change to true restarts with counter 1.
  void set_active(bool active);

  // Starts the period after a change; sends nothing.
  void apply_writes(Instant now);
  // Queues a SYNC if one is due and returns its counter (0 = without). The period does not drift;
  // missed SYNCs are skipped, and no SYNC is queued while another one is still in the transmit
  // queue.
  std::optional<std::uint8_t> advance(Instant now);
  // A time in the past (Instant{}) after a change: call apply_writes() or advance() at once.
  Instant next_wake() const { return next_; }

 private:
  void restart();
  std::uint8_t next_counter();

  can::TransmitQueue& transmit_;
  Parameters parameters_;
  bool active_ = false;
  bool anchored_ = true;  // next_ is a time, not a request for apply_writes()
  Instant next_ = kNever;
  std::uint8_t counter_ = 1;
};

}  // namespace linegate::sync
