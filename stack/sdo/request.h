// SPDX-License-Identifier: Apache-2.0
// What is asked of an sdo::Arbiter, and what it gives back.
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

// Most urgent first: a person or program waits for a command; booting brings a node back; routing
// serves other lines; background is what nobody waits for (scan).
enum class Priority : std::uint8_t { command, boot, routing, background };
inline constexpr std::size_t kPriorities = 4;

class Arbiter;
struct Completion;

// Makes requests of an Arbiter and outlives them: its destructor calls Arbiter::disown(). The
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
  // The end of one of its transfers. Called within Arbiter::deliver_completions() alone; may call
  // every other function of the arbiter.
  virtual void completed(Completion& completion, Instant now) = 0;
};

// Uses a channel of the arbiter frame by frame: it sends its requests on 600h + node-ID itself, and
// gets the responses on 580h + node-ID, until it releases the channel.
class ChannelUser : public RequestOwner {
 public:
  // The channel is its own; may be called within Arbiter::submit().
  virtual void granted(std::uint64_t number, Instant now) = 0;
  // A response of the server, of 8 bytes.
  virtual void response(std::uint64_t number, const can::Frame& frame) = 0;
};

struct Request {
  TransferOwner* owner = nullptr;  // of a transfer
  ChannelUser* user = nullptr;     // instead: number, group, node and priority count
  std::uint64_t number = 0;        // chosen by the owner, unique among its requests of the node
  std::uint8_t group = 0;          // requests of an owner that share its turns
  std::uint8_t node = 0;           // 1..127
  od::Address address{};
  bool write = false;
  std::vector<std::byte> data{};     // to be written
  od::ByteSource* source = nullptr;  // instead of data; must live until the Completion
  od::ByteSink* sink = nullptr;      // takes what is read, instead of Completion::data; likewise
  Duration timeout = std::chrono::milliseconds(500);  // for each answer of the server, positive
  Priority priority = Priority::command;
  TransferOptions options{};
};

struct Completion {
  std::uint64_t number = 0;
  std::uint8_t node = 0;
  od::Address address{};
  bool write = false;
  AbortCode abort = AbortCode::none;  // none: done
  std::vector<std::byte> data{};      // what was read
  bool refused = false;               // see Outcome
};

}  // namespace linegate::sdo
