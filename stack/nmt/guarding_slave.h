// SPDX-License-Identifier: Apache-2.0
// Node guarding and life guarding of the own node (CiA 301, 7.2.8.3.2.1): the NMT slave's side.
//   100Ch  U16  guard time in ms
//   100Dh  U8   life time factor; guard time x factor = life time, 0 = no life guarding
// The answer to a remote frame on 700h + node-ID is one byte: bit 7 toggles, starting with 0; bits
// 0..6 are the NMT state.
#pragma once

#include <cstdint>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/transmit_queue.h"
#include "stack/nmt/state.h"
#include "stack/od/dictionary.h"

namespace linegate::nmt {

// Called after the event was emitted.
class LifeGuardingListener {
 public:
  virtual ~LifeGuardingListener() = default;
  virtual void life_guarding_lost(Instant deadline) = 0;
  virtual void life_guarding_recovered(Instant now) = 0;
};

// Hook of 100Ch and 100Dh: after a write, life guarding restarts with the next request. Emits
// heartbeat_lost and heartbeat_recovered of the own node. Inactive while there is a heartbeat
// (1017h): a node uses only one kind of error control.
class GuardingSlave final : public od::Hook {
 public:
  // All must outlive this object; node_id is 1..127. The owner sets the hook and registers the
  // identifier.
  GuardingSlave(const od::Dictionary& dictionary, can::TransmitQueue& transmit, EventLog& events,
                LifeGuardingListener& listener, std::uint8_t node_id);

  // Call it after a reset: the next answer has toggle bit 0, life guarding starts with the first
  // request.
  void configure();
  // The state in the answers; in Initialising there are none.
  void set_state(State state) { state_ = state; }

  // The master's remote frame was received at `now`; it may have any data length code.
  void request(Instant now);

  // While suspended no request is expected, and none begins life guarding.
  void set_suspended(bool suspended) {
    suspended_ = suspended;
    deadline_ = kNever;
  }
  // Reports life guarding as lost if no request was received for the life time.
  void advance(Instant now);
  Instant next_wake() const { return deadline_; }

  void written(od::Address address) override;

 private:
  bool has_heartbeat() const;
  Duration life_time() const;
  void lose();
  void recover(Instant now);

  const od::Dictionary& dictionary_;
  can::TransmitQueue& transmit_;
  EventLog& events_;
  LifeGuardingListener& listener_;
  std::uint8_t node_id_;
  State state_ = State::initialising;
  std::byte toggle_{0};
  bool lost_ = false;
  bool suspended_ = false;
  Instant deadline_ = kNever;
};

}  // namespace linegate::nmt
