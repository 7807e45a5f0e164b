// SPDX-License-Identifier: Apache-2.0
// The input of the target dds_samples: any number of samples, one after the other.
//
// A sample is its topic (1 octet, modulo kTopics), how many octets follow (2, little-endian; what
// is there, if there are fewer), and the octets as DDS carries them: encapsulation and CDR.
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

// What the target's gateway and client are, and what they wait for.
inline constexpr const char* kGateway = "g";
inline constexpr const char* kLine = "line1";
inline constexpr const char* kClient = "c";
inline constexpr std::uint64_t kIncarnation = 77;
inline constexpr std::uint64_t kRequests = 4;  // ids 1..4 of the client are under way

}  // namespace linegate::fuzz
