// SPDX-License-Identifier: Apache-2.0
// Requests to an sdo::Arbiter, and their completions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/base/assert.h"
#include "stack/base/time.h"
#include "stack/od/description.h"
#include "stack/sdo/client.h"

namespace linegate::sdo {

// Most urgent first. command: a person or program waits for it; boot: returns a node to operation;
// routing: serves other lines; background: scan.
enum class Priority : std::uint8_t { command, boot, routing, background };
inline constexpr std::size_t kPriorities = 4;

class Arbiter;
struct Completion;

// Submits requests to an Arbiter and outlives them: its destructor calls Arbiter::disown(). The
// owners take turns at the queue of a node.
class RequestOwner {
 public:
  RequestOwner() = default;
  RequestOwner(const RequestOwner&) = delete;
  RequestOwner& operator=(const RequestOwner&) = delete;
  virtual ~RequestOwner() {
    LINEGATE_ASSERT(open_ == 0, "the owner of SDO requests has called disown()");
  }

 private:
  friend class Arbiter;
  std::size_t open_ = 0;  // requests that have not ended
};

class TransferOwner : public RequestOwner {
 public:
  // Reports the end of one of its transfers. Called only within Arbiter::deliver_completions(); may
  // call every other function of the arbiter.
  virtual void completed(Completion& completion, Instant now) = 0;
};

// Uses a channel of the arbiter frame by frame: it sends its own requests on 600h + node-ID, and
// receives the responses on 580h + node-ID, until it releases the channel.
class ChannelUser : public RequestOwner {
 public:
  // The channel is granted; may be called within Arbiter::submit().
  virtual void granted(std::uint64_t number, Instant now) = 0;
  // A response of the server, always 8 bytes.
  virtual void response(std::uint64_t number, const can::Frame& frame) = 0;
};

struct Request {
  TransferOwner* owner = nullptr;  // for a transfer
  // Instead of owner; only number, group, node, priority and client are used. It counts its frames
  // itself.
  ChannelUser* user = nullptr;
  std::uint64_t number = 0;  // chosen by the owner, unique among its requests to the node
  std::uint8_t group = 0;    // requests of an owner in one group share its turns
  std::uint8_t node = 0;     // 1..127
  od::Address address{};
  bool write = false;
  std::vector<std::byte> data{};     // value to write
  od::ByteSource* source = nullptr;  // instead of data; must live until the Completion
  // Receives the uploaded bytes instead of Completion::data; must live until the Completion.
  od::ByteSink* sink = nullptr;
  Duration timeout = std::chrono::milliseconds(500);  // for each answer of the server, positive
  Priority priority = Priority::command;
  // Whose command caused it: its frames are limited by the Pace. 0: nobody's; it is not limited.
  std::uint32_t client = 0;
  TransferOptions options{};
};

struct Completion {
  std::uint64_t number = 0;
  std::uint8_t node = 0;
  od::Address address{};
  bool write = false;
  AbortCode abort = AbortCode::none;  // none = success
  std::vector<std::byte> data{};      // the uploaded value
  bool refused = false;               // see Outcome
};

}  // namespace linegate::sdo
