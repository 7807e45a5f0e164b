// SPDX-License-Identifier: Apache-2.0
// Numbers for the clients whose requests were received, and their names for people.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

#include "gateway/publish/data_edge.h"

namespace linegate::gateway {

// Thread-safe. The number of a client is that of line::Command::client and of events.
class ClientDirectory {
 public:
  // Beyond it, the client whose last request is the oldest is forgotten: it gets a new number.
  static constexpr std::size_t kMost = 1024;

  // From 1, the same for all requests of one participant. name: the one in the request, for people
  // alone.
  std::uint32_t number(const ClientIdentity& from, std::string_view name);
  // The name in its last request; empty if it was forgotten.
  std::string name(std::uint32_t number) const;
  // "hmi at panel3", with an authenticated subject "alice (hmi at panel3)"; "client 7" if it was
  // forgotten. Printable.
  std::string describe(std::uint32_t number) const;

 private:
  struct Client {
    std::uint32_t number = 0;
    std::uint64_t used = 0;  // number of its last request
    std::string name;
    std::string host;
    std::string subject;
  };
  using Clients = std::map<std::array<std::uint8_t, 12>, Client>;

  mutable std::mutex mutex_;
  Clients clients_;
  std::uint64_t requests_ = 0;
  std::uint32_t numbers_ = 0;
};

}  // namespace linegate::gateway
