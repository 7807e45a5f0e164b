// SPDX-License-Identifier: Apache-2.0
// Receives the SRDOs of the nodes (EN 50325-5), without producing any. Private to stack/line.
#pragma once

#include <cstdint>
#include <span>

#include "stack/line/service.h"
#include "stack/line/srdo_reception.h"

namespace linegate::line {

class SrdoService final : public Service {
 public:
  // All must outlive the service; rpdos are those of the engine.
  SrdoService(ServiceHost& host, const LineConfig& config, can::Dispatch& dispatch,
              EventLog& events, pdo::Engine& engine, image::ProcessImage& image,
              std::span<const pdo::LinkedPdo> rpdos)
      : Service(host), reception_(dispatch, events, config) {
    reception_.connect(engine, image, rpdos);
  }

  bool needs_master() const override { return false; }
  // target: index of the target with can::Service::srdo.
  void receive(std::uint16_t target, const can::Frame& frame) { reception_.receive(target, frame); }
  // See SrdoReception.
  std::uint8_t node_of(std::uint16_t target) const { return reception_.node_of(target); }
  void forget(std::uint8_t node) { reception_.forget(node); }
  void advance(Instant now) override { reception_.advance(now); }
  Instant next_wake() const override { return reception_.next_wake(); }
  void end(Refusal /*why*/, Instant /*now*/) override {}
  SrdoCounters counters() const { return reception_.counters(); }

 private:
  SrdoReception reception_;
};

}  // namespace linegate::line
