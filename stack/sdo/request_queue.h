// SPDX-License-Identifier: Apache-2.0
// The requests that wait for one SDO server, and their order.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stack/sdo/pace.h"
#include "stack/sdo/request.h"

namespace linegate::sdo {

// Ordered by Priority; within a priority the parties take turns, and requests of one party keep
// their order. Every eighth request is the one that waits longest, whatever its priority, which
// prevents starvation. A request that the pace does not permit yet precedes none: it would occupy
// the server without a frame on the bus.
class RequestQueue {
 public:
  static constexpr std::uint64_t kOldestEvery = 8;

  explicit RequestQueue(std::size_t capacity) : capacity_(capacity) {}

  // An owner's group, which takes turns with the others.
  struct Party {
    const RequestOwner* owner = nullptr;
    std::uint8_t group = 0;
    bool operator==(const Party&) const = default;
  };
  static Party party(const Request& request) { return {owner(request), request.group}; }
  static RequestOwner* owner(const Request& request) {
    return request.user != nullptr ? static_cast<RequestOwner*>(request.user) : request.owner;
  }

  // Returns false, and leaves the request unchanged, if the queue is full.
  bool push(Request&& request);
  // Removes the next request that pace permits; false if there is none. nullptr permits all.
  bool pop(Request& out, const Pace* pace = nullptr);
  // Whether a request that the pace permits waits, and is not of that client.
  bool has_other(std::uint32_t client, const Pace& pace) const;
  // Removes the owner's request with this number; false if there is none.
  bool remove(const RequestOwner& owner, std::uint64_t number, Request& out);
  // Removes all requests of the owner and returns their number.
  std::size_t remove_all(const RequestOwner& owner);

  std::size_t size() const { return waiting_.size(); }
  bool empty() const { return waiting_.empty(); }

 private:
  // Each party gets one place in a turn.
  struct Waiting {
    Request request;
    std::uint64_t turn = 0;
  };
  struct Turn {
    std::uint64_t number = 0;
    std::vector<Party> served;  // parties served in this turn
  };

  std::size_t next(const Pace* pace) const;
  void note_served(const Waiting& waiting);
  void take(std::size_t position, Request& out);
  Turn& turn(const Request& request) { return turns_[static_cast<std::size_t>(request.priority)]; }

  std::size_t capacity_;
  std::vector<Waiting> waiting_;  // in order of arrival
  std::array<Turn, kPriorities> turns_;
  std::uint64_t popped_ = 0;
};

}  // namespace linegate::sdo
