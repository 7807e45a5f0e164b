// SPDX-License-Identifier: Apache-2.0
// The forwarded EMCY (CiA 302-7). According to the public texts it carries source network, source
// node and error code, and the manufacturer bytes are dropped; its layout is OWN definition C, see
// README.md.
//   bytes 0..1  emergency error code of the source; 0000h = error reset
//   byte 2      error register of the source
//   bytes 3..4  network-ID of the source
//   byte 5      node-ID of the source
//   byte 6      hops: 1 at the first gateway, incremented by each further one
//   byte 7      number, incremented by the first gateway with each EMCY
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "stack/base/byte_order.h"
#include "stack/emcy/message.h"

namespace linegate::routing {

struct ForwardedEmcy {
  std::uint16_t code = 0;
  std::uint8_t error_register = 0;
  std::uint16_t network = 0;
  std::uint8_t node = 0;
  std::uint8_t hops = 1;
  std::uint8_t number = 0;

  // The same EMCY, received over another route.
  bool same(const ForwardedEmcy& other) const {
    return network == other.network && node == other.node && number == other.number &&
           code == other.code && error_register == other.error_register;
  }
};

inline emcy::Message encode(const ForwardedEmcy& emcy) {
  emcy::Message out{.code = emcy.code, .error_register = emcy.error_register};
  store_le(out.info.data(), emcy.network);
  out.info[2] = std::byte{emcy.node};
  out.info[3] = std::byte{emcy.hops};
  out.info[4] = std::byte{emcy.number};
  return out;
}

// Nothing if it is not a forwarded EMCY: network or hops are 0, or the node is not 1..127.
inline std::optional<ForwardedEmcy> decode(const emcy::Message& message) {
  const auto byte = [&](std::size_t i) { return std::to_integer<std::uint8_t>(message.info[i]); };
  const ForwardedEmcy out{.code = message.code,
                          .error_register = message.error_register,
                          .network = load_le<std::uint16_t>(message.info.data()),
                          .node = byte(2),
                          .hops = byte(3),
                          .number = byte(4)};
  const bool good =
      out.network != 0 && out.node >= 1 && out.node <= can::kMaxNodeId && out.hops != 0;
  return good ? std::optional(out) : std::nullopt;
}

}  // namespace linegate::routing
