// SPDX-License-Identifier: Apache-2.0
// Receives the SRDOs of the nodes (EN 50325-5), without producing any, and compares their
// signatures in 13FFh after each boot of a node. Private to stack/line.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stack/line/service.h"
#include "stack/line/srdo_reception.h"
#include "stack/manager/manager.h"
#include "stack/sdo/arbiter.h"

namespace linegate::line {

class SrdoService final : public Service, sdo::TransferOwner {
 public:
  struct Parts {
    can::Dispatch& dispatch;
    EventLog& events;
    pdo::Engine& engine;
    image::ProcessImage& image;
    std::span<const pdo::LinkedPdo> rpdos;  // of the engine
    sdo::Arbiter& sdo;
    const manager::Manager& manager;
  };
  // All must outlive the service.
  SrdoService(ServiceHost& host, const LineConfig& config, const Parts& parts);
  ~SrdoService() override;

  // target: index of the target with can::Service::srdo.
  void receive(std::uint16_t target, const can::Frame& frame) { reception_.receive(target, frame); }
  // See SrdoReception.
  std::uint8_t node_of(std::uint16_t target) const { return reception_.node_of(target); }
  void forget(std::uint8_t node) { reception_.forget(node); }
  // Reads the signatures of nodes that have booted.
  void advance(Instant now) override;
  Instant next_wake() const override { return reception_.next_wake(); }
  void end(Refusal why, Instant now) override;
  SrdoCounters counters() const { return reception_.counters(); }

 private:
  void completed(sdo::Completion& completion, Instant now) override;
  bool has_booted(std::uint8_t node) const;

  Duration timeout_;
  sdo::Arbiter& sdo_;
  const manager::Manager& manager_;
  SrdoReception reception_;
  std::vector<bool> asked_;  // by source: its signature was read since the node booted
};

}  // namespace linegate::line
