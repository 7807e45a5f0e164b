// SPDX-License-Identifier: Apache-2.0
// SYNC of one node: the objects 1005h, 1006h, 1007h, 1019h and the producer or consumer that they
// configure.
#pragma once

#include <cstdint>
#include <optional>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/dispatch.h"
#include "stack/can/frame.h"
#include "stack/can/transmit_queue.h"
#include "stack/od/dictionary.h"
#include "stack/sync/consumer.h"
#include "stack/sync/producer.h"

namespace linegate::sync {

// Hook of these objects: writes take effect at once.
class Service final : public od::Hook {
 public:
  // All must outlive the service. The owner sets the hook.
  Service(const od::Dictionary& dictionary, can::Dispatch& dispatch, can::TransmitQueue& transmit,
          EventLog& events);

  // Event::node of its events.
  void set_node_id(std::uint8_t id) { consumer_.set_node_id(id); }
  // Reads the objects and restarts.
  void configure();
  // True in Pre-operational and Operational.
  void set_active(bool active);
  // See Consumer. The own SYNCs continue.
  void set_suspended(bool suspended) { consumer_.set_suspended(suspended); }

  // Time after a SYNC during which synchronous PDOs may be received and sent; 0 = until the next
  // SYNC.
  Duration window() const { return parameters_.window; }
  // True from a missing SYNC until the next one.
  bool lost() const { return consumer_.lost(); }

  Reception receive(const can::Frame& frame) { return consumer_.receive(frame); }

  // Starts periods after a write; processes no time-out.
  void apply_writes(Instant now) { producer_.apply_writes(now); }
  // Returns the counter of the SYNC (0 = without) if one was queued now: the own node has to
  // process it too.
  std::optional<std::uint8_t> advance(Instant now);
  Instant next_wake() const { return earlier(producer_.next_wake(), consumer_.next_wake()); }

  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  void written(od::Address address) override;

 private:
  const od::Dictionary& dictionary_;
  Parameters parameters_;
  Producer producer_;
  Consumer consumer_;
};

}  // namespace linegate::sync
