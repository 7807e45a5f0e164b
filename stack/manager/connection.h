// SPDX-License-Identifier: Apache-2.0
// The SDO connections that the manager assigns, as plain values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "stack/base/abort_code.h"

namespace linegate::manager {

// CAN-IDs for connections, 11 bits. Each connection takes two that follow each other: the lower one
// from server to client, the higher one from client to server. first 0: there are none.
struct ConnectionPool {
  std::uint16_t first = 0;
  std::uint16_t last = 0;

  constexpr std::size_t pairs() const {
    return first == 0 || last <= first ? 0 : (last - first + 1U) / 2;
  }
  constexpr bool has(std::uint32_t id) const { return first != 0 && id >= first && id <= last; }

  friend bool operator==(const ConnectionPool&, const ConnectionPool&) = default;
};

// The numbers are part of the DDS contract: append new values at the end only.
enum class ConnectionState : std::uint8_t {
  opening,  // its records are being searched or written
  open,     // both records are valid
  closing,  // its records are being set to not valid
  stale,    // a record could not be set to not valid: its COB-IDs are not assigned again
};
std::string_view name(ConnectionState state);

struct Connection {
  std::uint32_t number = 0;         // from 1, in the order of the requests
  std::uint8_t client = 0;          // node-ID
  std::uint8_t server = 0;          // node-ID
  std::uint16_t client_record = 0;  // object of the client, 1280h to 12FFh; 0 = not found yet
  std::uint16_t server_record = 0;  // object of the server, 1201h to 127Fh; 0 = not found yet
  std::uint16_t request = 0;        // CAN-ID from client to server; 0 = not assigned yet
  std::uint16_t response = 0;       // CAN-ID from server to client; 0 = not assigned yet
  ConnectionState state = ConnectionState::opening;
  // Stale: how the write that should have set a record to not valid ended.
  AbortCode abort = AbortCode::none;

  friend bool operator==(const Connection&, const Connection&) = default;
};

}  // namespace linegate::manager
