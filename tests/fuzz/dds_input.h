// SPDX-License-Identifier: Apache-2.0
// The input of the target dds_samples: any number of samples, one after the other.
//
// A sample consists of its topic (1 octet, modulo kTopics), the number of octets that follow (2,
// little-endian; if fewer follow, those are taken), and the octets as DDS transports them:
// encapsulation and CDR.
#pragma once

#include <cstdint>

namespace linegate::fuzz {

enum class Topic : std::uint8_t {
  line_state,
  node_state,
  image_layout,
  process_image,
  pdo_update,
  event,
  output_write,
  command_request,
  command_reply,
  gateway_state,
  output_state,
  pdo_reception,
};
inline constexpr unsigned kTopics = 12;

// The identity of the target's gateway and client, and the pending requests.
inline constexpr const char* kGateway = "g";
inline constexpr const char* kLine = "line1";
inline constexpr const char* kClient = "c";
inline constexpr std::uint64_t kIncarnation = 77;
inline constexpr std::uint64_t kRequests = 4;  // requests 1..4 of the client are pending

}  // namespace linegate::fuzz
