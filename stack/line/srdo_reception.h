// SPDX-License-Identifier: Apache-2.0
// Connects the SRDOs that the nodes of a line transmit to the inputs of its image: an input is
// valid while its SRDO is. Private to stack/line.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stack/image/process_image.h"
#include "stack/line/config.h"
#include "stack/line/state.h"
#include "stack/pdo/engine.h"
#include "stack/pdo/link.h"
#include "stack/srdo/consumer.h"

namespace linegate::line {

class SrdoReception final : srdo::Listener {
 public:
  // Registers the identifiers with Service::srdo. The dispatch and the events must outlive it.
  SrdoReception(can::Dispatch& dispatch, EventLog& events, const LineConfig& config);

  // rpdos: those of the engine, with the SRDOs. All must outlive this object, or the next call.
  void connect(pdo::Engine& engine, image::ProcessImage& image,
               std::span<const pdo::LinkedPdo> rpdos);

  // Returns true if a valid pair is complete.
  bool receive(std::uint16_t target, const can::Frame& frame) {
    return consumer_.receive(target, frame);
  }
  // The node that transmits the SRDO of a target.
  std::uint8_t node_of(std::uint16_t target) const {
    return consumer_.sources()[srdo::Consumer::source_of(target)].node;
  }
  // The data of the node are no longer valid: its SRDOs are not received.
  void forget(std::uint8_t node);
  void forget_all();
  void advance(Instant now) { consumer_.advance(now); }
  Instant next_wake() const { return consumer_.next_wake(); }
  SrdoCounters counters() const;

 private:
  void srdo_received(std::size_t source, const can::Frame& normal) override;
  void srdo_unsafe(std::size_t source) override;

  srdo::Consumer consumer_;
  pdo::Engine* engine_ = nullptr;
  image::ProcessImage* image_ = nullptr;
  std::vector<std::uint16_t> rpdos_;  // by source: number of its RPDO; 0 = not in the image
};

}  // namespace linegate::line
