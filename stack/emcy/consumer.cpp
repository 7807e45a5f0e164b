// SPDX-License-Identifier: Apache-2.0
#include "stack/emcy/consumer.h"

#include <optional>

#include "stack/can/cob_id.h"

namespace linegate::emcy {
namespace {

bool exists(std::uint8_t node) {
  return node >= can::kMinNodeId && node <= can::kMaxNodeId;
}

}  // namespace

Consumer::Consumer(can::Dispatch& dispatch, EventLog& events, std::uint16_t mark)
    : dispatch_(dispatch), events_(events), mark_(mark) {
}

Consumer::~Consumer() {
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    ignore(node);
  }
}

void Consumer::listen(std::uint8_t node, can::CobId cob_id) {
  if (!exists(node) || cob_ids_[node] == cob_id) {
    return;
  }
  ignore(node);
  if (can::is_usable(cob_id)) {
    cob_ids_[node] = cob_id;
    dispatch_.add(cob_id.id(), cob_id.extended(), can::Service::emcy,
                  static_cast<std::uint16_t>(mark_ | node));
  }
}

void Consumer::listen_all(std::uint8_t own) {
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    if (node != own) {
      listen(node, can::CobId{can::kEmcyBase + node});
    }
  }
}

void Consumer::ignore(std::uint8_t node) {
  if (exists(node) && cob_ids_[node].valid()) {
    dispatch_.remove(cob_ids_[node].id(), cob_ids_[node].extended(), can::Service::emcy,
                     static_cast<std::uint16_t>(mark_ | node));
    cob_ids_[node] = can::CobId{};
  }
}

bool Consumer::receive(std::uint8_t node, const can::Frame& frame) {
  std::optional<Message> message = decode(frame);
  if (!message && accepts_fd_) {
    message = decode_fd(frame);
  }
  if (!message) {
    return false;
  }
  ++received_;
  events_.emit({.time = frame.time, .node = node, .data = to_event<event::Emcy>(*message)});
  if (listener_ != nullptr) {
    listener_->emergency(node, *message, frame.time);
  }
  return true;
}

}  // namespace linegate::emcy
