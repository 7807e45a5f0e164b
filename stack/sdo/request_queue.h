// SPDX-License-Identifier: Apache-2.0
// The requests that wait for one SDO server, and which of them comes next.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stack/sdo/request.h"

namespace linegate::sdo {

// By Priority; within a priority the parties take turns, and requests of one party keep their
// order. Every eighth request taken is the one that waits longest, whatever its
// priority, so that nobody waits for ever.
class RequestQueue {
 public:
  static constexpr std::uint64_t kOldestEvery = 8;

  explicit RequestQueue(std::size_t capacity) : capacity_(capacity) {}

  // Whose turn it is.
  struct Party {
    const RequestOwner* owner = nullptr;
    std::uint8_t group = 0;
    bool operator==(const Party&) const = default;
  };
  static Party party(const Request& request) { return {owner(request), request.group}; }
  static RequestOwner* owner(const Request& request) {
    return request.user != nullptr ? static_cast<RequestOwner*>(request.user) : request.owner;
  }

  // False if it is full: the request was not taken.
  bool push(Request&& request);
  // The next one; false if there is none.
  bool pop(Request& out);
  // The one of this owner with this number; false if there is none.
  bool remove(const RequestOwner& owner, std::uint64_t number, Request& out);
  // All of this owner; returns how many there were.
  std::size_t remove_all(const RequestOwner& owner);

  std::size_t size() const { return waiting_.size(); }
  bool empty() const { return waiting_.empty(); }

 private:
  // A party gets one place in each turn.
  struct Waiting {
    Request request;
    std::uint64_t turn = 0;
  };
  struct Turn {
    std::uint64_t number = 0;
    std::vector<Party> served;  // those that had their place in it
  };

  std::size_t next() const;
  void note_served(const Waiting& waiting);
  void take(std::size_t position, Request& out);
  Turn& turn(const Request& request) { return turns_[static_cast<std::size_t>(request.priority)]; }

  std::size_t capacity_;
  std::vector<Waiting> waiting_;  // in order of arrival
  std::array<Turn, kPriorities> turns_;
  std::uint64_t popped_ = 0;
};

}  // namespace linegate::sdo
