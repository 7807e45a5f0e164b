// SPDX-License-Identifier: Apache-2.0
// What is asked of an sdo::Arbiter, and what it gives back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/base/time.h"
#include "stack/od/description.h"
#include "stack/sdo/client.h"

namespace linegate::sdo {

// Most urgent first: a person or program waits for a command; booting brings a node back; routing
// serves other lines; background is what nobody waits for (scan).
enum class Priority : std::uint8_t { command, boot, routing, background };
inline constexpr std::size_t kPriorities = 4;

// Somebody who uses a channel of the arbiter frame by frame: it sends what it wants to 600h +
// node-ID itself, and gets what comes on 580h + node-ID, until it releases the channel.
class ChannelUser {
 public:
  virtual ~ChannelUser() = default;
  // The channel is its own; may be called within Arbiter::submit().
  virtual void granted(std::uint64_t token, Instant now) = 0;
  // An answer of the server, of 8 bytes.
  virtual void response(std::uint64_t token, const can::Frame& frame) = 0;
  // The arbiter took the channel away, or the request out of its queue.
  virtual void withdrawn(std::uint64_t token, AbortCode why) = 0;
};

struct Request {
  std::uint64_t token = 0;  // chosen by the caller, unique among its requests; bits 63..48 name the
                            // owner, for fairness
  std::uint8_t node = 0;    // 1..127
  od::Address address{};
  bool write = false;
  std::vector<std::byte> data{};     // to be written
  od::ByteSource* source = nullptr;  // instead of data; must live until the Completion
  od::ByteSink* sink = nullptr;      // takes what is read, instead of Completion::data; likewise
  Duration timeout = std::chrono::milliseconds(500);  // for each answer of the server, positive
  Priority priority = Priority::command;
  TransferOptions options{};
  ChannelUser* user = nullptr;  // instead of a transfer: token, node and priority count
};

struct Completion {
  std::uint64_t token = 0;
  std::uint8_t node = 0;
  od::Address address{};
  bool write = false;
  AbortCode abort = AbortCode::none;  // none: done
  std::vector<std::byte> data{};      // what was read
  bool refused = false;               // see Outcome
};

}  // namespace linegate::sdo
