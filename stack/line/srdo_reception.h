// SPDX-License-Identifier: Apache-2.0
// Connects the SRDOs that the nodes of a line transmit to the inputs of its image: an input is
// valid while its SRDO is. Private to stack/line.
#pragma once

#include <cstdint>
#include <set>
#include <span>
#include <vector>

#include "stack/image/process_image.h"
#include "stack/line/config.h"
#include "stack/line/state.h"
#include "stack/manager/object_write.h"
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
  bool receive(std::uint16_t target, const can::Frame& frame);
  // The node has this value of an object. An SRDO with a parameter that is not that of the image is
  // not received, until the node has the right one again.
  void learn(std::uint8_t node, od::Address address, std::span<const std::byte> value);
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
  std::span<const srdo::Source> sources() const { return consumer_.sources(); }
  // See srdo::Consumer::check_signature(). The second one has no effect without such an SRDO.
  void check_signature(std::size_t source, std::uint16_t found, Instant now) {
    consumer_.check_signature(source, found, now);
  }
  void check_signature(std::uint8_t node, std::uint8_t number, std::uint16_t found, Instant now);

 private:
  void srdo_received(std::size_t source, const can::Frame& normal) override;
  void srdo_unsafe(std::size_t source) override;

  srdo::Consumer consumer_;
  pdo::Engine* engine_ = nullptr;
  image::ProcessImage* image_ = nullptr;
  std::vector<std::uint16_t> rpdos_;  // by source: number of its RPDO; 0 = not in the image
  std::vector<std::vector<manager::ObjectWrite>> parameters_;  // by source: those of the image
  std::vector<std::set<od::Address>> differing_;               // by source: parameters that differ
};

}  // namespace linegate::line
