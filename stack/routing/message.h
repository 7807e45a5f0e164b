// SPDX-License-Identifier: Apache-2.0
// The messages between the lines of one process: a plain value, small enough for a ring between two
// threads. Line::pop_message() returns a line's messages to other lines, Line::deliver() takes
// those of other lines.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/base/byte_order.h"

namespace linegate::routing {

enum class MessageKind : std::uint8_t {
  // An SDO connection, opened by the line of the client. data is 0 unless it is described here.
  // network, node, gateway, hops, source, of_process: reserve a client channel for the connection.
  // data: the number of the client in this process whose command it is, 0 = nobody's (U32, LE) in
  // bytes 0..3; see sdo::Pace
  sdo_open,
  sdo_opened,  // the route is free
  // The connection has ended: refused, or ended on the target's side. data: abort code (U32, LE) in
  // bytes 0..3
  sdo_refused,
  sdo_request,   // data: 8 bytes from client to server
  sdo_response,  // data: 8 bytes from server to client
  sdo_close,     // the connection has ended on the client's side. data: abort code as above
  emcy,          // data: a forwarded EMCY, see README.md
  pdo,           // a forwarded object of the process data
  // Of an SDO connection: the share of the client (see sdo_open) does not permit its frames yet.
  // They wait on the target's side, and the time-outs of the client begin again.
  sdo_paced,
};

struct Message {
  std::uint8_t from = 0;  // numbers of the two lines (interfaces), 1..255
  std::uint8_t to = 0;
  MessageKind kind = MessageKind::sdo_open;
  std::uint8_t hops = 0;         // number of gateways on the route so far, including this one
  std::uint32_t connection = 0;  // chosen by the opening line, unique among its open connections
  std::uint16_t network = 0;     // network-ID of the target
  std::uint16_t source = 0;      // network-ID of the source; 0 = this process itself
  std::uint8_t node = 0;         // node-ID of the target; 0 = the gateway itself
  std::uint8_t gateway = 0;  // next gateway on the interface `to`, 0 = the target is attached to it
  bool of_process = false;   // the client is this process, even if source is a network
  std::array<std::byte, 8> data{};
};
static_assert(sizeof(Message) <= 32);

// Answers a message of a connection and ends the connection.
inline Message refusal(const Message& message, AbortCode why) {
  const bool to_target = message.kind == MessageKind::sdo_response;
  Message out{.from = message.to,
              .to = message.from,
              .kind = to_target ? MessageKind::sdo_close : MessageKind::sdo_refused,
              .connection = message.connection};
  store_le(out.data.data(), static_cast<std::uint32_t>(why));
  return out;
}

inline AbortCode abort_of(const Message& message) {
  return static_cast<AbortCode>(load_le<std::uint32_t>(message.data.data()));
}

// For the carrier of messages: the reply for the sender (`from`) of a message that cannot be
// delivered, because there is no such line or no room on the way to it. Nothing if the sender
// expects no reply.
inline std::optional<Message> undeliverable(const Message& message) {
  switch (message.kind) {
    case MessageKind::sdo_open:
    case MessageKind::sdo_request:
    case MessageKind::sdo_response:
      return refusal(message, AbortCode::device_state);
    default:
      return std::nullopt;
  }
}

// A queue of messages, first in, first out. Allocates only in the constructor.
class MessageQueue {
 public:
  explicit MessageQueue(std::size_t capacity) : ring_(capacity) {}

  // False if the queue is full: the message was not added.
  bool push(const Message& message) {
    if (count_ == ring_.size()) {
      return false;
    }
    ring_[(first_ + count_++) % ring_.size()] = message;
    return true;
  }
  // Removes the oldest message; false if there is none.
  bool pop(Message& out) {
    if (count_ == 0) {
      return false;
    }
    out = ring_[first_];
    first_ = (first_ + 1) % ring_.size();
    --count_;
    return true;
  }
  std::size_t room() const { return ring_.size() - count_; }
  bool empty() const { return count_ == 0; }

 private:
  std::vector<Message> ring_;
  std::size_t first_ = 0;
  std::size_t count_ = 0;
};

}  // namespace linegate::routing
