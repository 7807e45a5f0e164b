// SPDX-License-Identifier: Apache-2.0
// The own node as a flying master (CiA 302-2): follows 1F80h bit 5 and 1F90h, sends and receives
// 071h to 076h, and monitors the active master by 1016h. The line takes the role that it permits.
// Private to stack/line.
//
// While another node is the active master, the own node produces neither SYNC nor TIME: bit 30 of
// 1005h and 1012h is clear, and set again when it is the active master. They are stored (1010h) as
// for the active master.
#pragma once

#include <cstdint>

#include "stack/base/event_log.h"
#include "stack/line/config.h"
#include "stack/line/nmt_service.h"
#include "stack/line/own_objects.h"
#include "stack/line/service.h"
#include "stack/manager/manager.h"
#include "stack/nmt/flying_master.h"
#include "stack/node/node.h"
#include "stack/od/hook.h"
#include "stack/storage/image.h"

namespace linegate::line {

class FlyingMasterService final : public Service, nmt::FlyingMasterHost, od::Hook {
 public:
  // The parts that it uses; all must outlive it.
  struct Parts {
    node::Node& node;  // the own node
    OwnObjects& own_objects;
    manager::Manager& manager;
    NmtHost& nmt_host;
    EventLog& events;
  };
  FlyingMasterService(ServiceHost& host, const LineConfig& config, const Parts& parts);
  ~FlyingMasterService() override;

  bool needs_master() const override { return false; }
  void advance(Instant now) override;
  Instant next_wake() const override;
  void end(Refusal /*why*/, Instant /*now*/) override {}

  // The own node is to take part in the negotiation: 1F80h bits 0 and 5.
  bool takes_part() const;
  // It takes part.
  bool competes() const { return machine_.state() != nmt::FlyingMasterState::none; }
  // It takes part, and is not the active master: it sends no outputs.
  bool is_passive() const { return competes() && !machine_.is_master(); }

  // The line was started.
  void start(Instant now);
  void stop(Instant now);
  // The own node boots, with the values with which it boots.
  void boot(Instant now);
  // A frame with one of 071h to 076h. Returns false if it is malformed.
  bool receive(const can::Frame& frame);
  // Another node sent that NMT command.
  void hear(const nmt::NodeControl& control, Instant now) { machine_.node_control(control, now); }
  void boot_up(Instant now) { machine_.boot_up(now); }
  void heartbeat(std::uint8_t node, Instant now) { machine_.heartbeat(node, now); }
  void heartbeat_lost(std::uint8_t node, Instant now) { machine_.heartbeat_lost(node, now); }
  // The bus accepts no frames, and the state machine is held until it does: advance() must be
  // called then.
  bool is_held() const { return held_; }
  // Whether a frame may be handed out although the bus seems to accept none: one a second, because
  // the acknowledgement of a frame may be lost, and that of a later one shows it.
  bool may_probe(Instant now) const { return now >= probe_at_; }
  void probed(Instant now);

  nmt::FlyingMasterState state() const { return machine_.state(); }
  std::uint8_t active_master() const { return machine_.active_master(); }
  std::uint8_t priority() const { return machine_.own_rank().priority; }

 private:
  void send_master_message(const can::Frame& frame, Instant now) override;
  bool reset_all(Instant now) override;
  void flying_master_changed(nmt::FlyingMasterState before, Instant now) override;
  bool monitors_master() const override { return has_entry_of_master(); }
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;

  bool hold(Instant now);
  Duration master_time() const;
  Duration consumer_time_of_master() const;
  void adjust_stored(storage::StoredValue& value) const;
  void follow_times();
  void follow_producers();
  void monitor_master();
  void forget_master();
  bool has_entry_of_master() const;

  const LineConfig& config_;
  Parts parts_;
  nmt::FlyingMaster machine_;
  std::uint8_t master_entry_ = 0;   // the sub-index of 1016h that it has written; 0 = none
  std::uint32_t master_value_ = 0;  // its value
  bool produces_ = true;            // SYNC and TIME are those of 1005h and 1012h
  bool sync_ = false;               // otherwise: bit 30 of 1005h was set
  bool time_ = false;               // the same for 1012h
  bool consumes_time_ = false;      // and bit 31
  bool held_ = false;
  Instant cut_since_ = kNever;  // the bus accepts no frames
  Instant look_at_ = kNever;    // an active master, or one that is held, looks whether it does
  Instant probe_at_{};          // see may_probe()
};

}  // namespace linegate::line
