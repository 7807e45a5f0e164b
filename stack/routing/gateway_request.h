// SPDX-License-Identifier: Apache-2.0
// Requests to another gateway: an SDO transfer as one value, because the other gateway carries it
// out as a command. See GatewayEgress.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/base/time.h"
#include "stack/od/description.h"

namespace linegate::routing {

// A line of another gateway.
struct GatewayLine {
  std::string gateway;
  std::string line;

  friend auto operator<=>(const GatewayLine&, const GatewayLine&) = default;
};

// A way to other networks: over a line of another gateway.
struct GatewayWay {
  GatewayLine to;
  // The request counts as that of a device on this line of the other gateway, whose routes it then
  // takes, so the access rules of the line that it enters apply. Empty: as that of a client.
  std::string enter{};
  // From the request to the answer of the other gateway
  Duration timeout = std::chrono::seconds(3);

  // The line that receives the request.
  GatewayLine addressed() const { return {to.gateway, enter.empty() ? to.line : enter}; }

  friend bool operator==(const GatewayWay&, const GatewayWay&) = default;
};

struct GatewayRequest {
  std::uint64_t number = 0;  // never used again by the line
  bool cancelled = false;    // the request with that number needs no answer any more
  std::shared_ptr<const GatewayWay> way{};
  Instant deadline{};  // the request must not be carried out afterwards
  std::uint16_t network = 0;
  std::uint8_t node = 0;  // 1..127
  std::uint8_t hops = 0;  // gateways that it has passed, this one included
  od::Address address{};
  bool write = false;
  std::vector<std::byte> data{};  // the value to write
};

struct GatewayAnswer {
  std::uint64_t number = 0;
  AbortCode abort = AbortCode::none;  // none: carried out
  // The result is not known: a write may have been carried out. abort is 0504 0000h.
  bool unknown = false;
  std::vector<std::byte> data{};  // the value that was read
};

}  // namespace linegate::routing
