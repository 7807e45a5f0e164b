// SPDX-License-Identifier: Apache-2.0
// The network indication, with which an SDO client selects the node and network of the next
// transfer at a gateway (CiA 302-7). The public texts give only the command specifier 7 and the
// contents; the bytes are OWN definition A, see README.md.
//
//   byte 0     E0h, request and response
//   byte 1, 2  target network-ID (LE); 0 = the network on which it is sent
//   byte 3     target node-ID; 0 = the gateway itself
//   byte 4     number of gateways on the route, 1 from the client, incremented by each gateway
//   byte 5..7  0
//
// The response has the same bytes. A refusal is an abort of object 0000h:00.
#pragma once

#include <cstdint>

namespace linegate::routing {

inline constexpr std::uint8_t kNetworkIndication = 0xE0;

struct Indication {
  std::uint16_t network = 0;
  std::uint8_t node = 0;
  std::uint8_t hops = 1;

  friend bool operator==(const Indication&, const Indication&) = default;
};

// The eight bytes as one number, byte 0 in the least significant bits, as everywhere in stack/sdo.
constexpr std::uint64_t encode(const Indication& indication) {
  return std::uint64_t{kNetworkIndication} | std::uint64_t{indication.network} << 8U |
         std::uint64_t{indication.node} << 24U | std::uint64_t{indication.hops} << 32U;
}
constexpr Indication decode_indication(std::uint64_t word) {
  return {.network = static_cast<std::uint16_t>(word >> 8U),
          .node = static_cast<std::uint8_t>(word >> 24U),
          .hops = static_cast<std::uint8_t>(word >> 32U)};
}
constexpr bool is_indication(std::uint64_t word) {
  return static_cast<std::uint8_t>(word) == kNetworkIndication;
}
// Command specifier 7, with any flags.
constexpr bool has_network_specifier(std::uint64_t word) {
  return (word & kNetworkIndication) == kNetworkIndication;
}

}  // namespace linegate::routing
