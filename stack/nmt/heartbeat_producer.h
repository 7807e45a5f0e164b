// SPDX-License-Identifier: Apache-2.0
// Boot-up message and heartbeat of the own node (CiA 301, 7.2.8.3.2.2, 7.2.8.3.3 and object 1017h):
// one byte on CAN-ID 700h + node-ID, 00h for boot-up, otherwise the NMT state.
#pragma once

#include <cstdint>

#include "stack/base/time.h"
#include "stack/can/transmit_queue.h"
#include "stack/nmt/state.h"
#include "stack/od/dictionary.h"

namespace linegate::nmt {

// Hook of 1017h (U16, ms, 0 = no heartbeat). A write restarts the heartbeat at once.
class HeartbeatProducer final : public od::Hook {
 public:
  // Both must outlive the producer; node_id is 1..127. The owner sets the hook.
  HeartbeatProducer(const od::Dictionary& dictionary, can::TransmitQueue& transmit,
                    std::uint8_t node_id);

  // Sends the boot-up message. It counts as the first heartbeat: the next one is due one period
  // later.
  void boot_up(Instant now);
  // The state in heartbeats from now on.
  void set_state(State state) { state_ = state; }

  // Sends the first heartbeat after a write to 1017h; processes no time-out.
  void apply_writes(Instant now);
  // Sends a heartbeat if one is due. The period does not drift: the next one is due one period
  // after the due time of this one. Missed heartbeats are skipped, and no heartbeat is queued while
  // another one is still in the transmit queue.
  void advance(Instant now);
  // A time in the past (Instant{}) after a write: call advance() or apply_writes() at once.
  Instant next_wake() const { return next_; }

  void written(od::Address address) override;

 private:
  void read_period();
  void send(std::uint8_t content);

  const od::Dictionary& dictionary_;
  can::TransmitQueue& transmit_;
  std::uint8_t node_id_;
  State state_ = State::initialising;
  Duration period_{};
  Instant next_ = kNever;
  bool restart_ = false;
};

}  // namespace linegate::nmt
