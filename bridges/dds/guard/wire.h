// SPDX-License-Identifier: Apache-2.0
// Fields of an RTPS 2.3 datagram in the octet order of its sender. No allocation, no copy.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace linegate::dds::guard {

using Octets = std::span<const std::uint8_t>;
using Prefix = std::array<std::uint8_t, 12>;  // GuidPrefix_t, RTPS 2.3 9.3.1.1
using Guid = std::array<std::uint8_t, 16>;    // prefix, then entity ID
using Number = std::int64_t;                  // SequenceNumber_t, RTPS 2.3 9.3.2.4

// Precondition of all reads: the field lies within size().
class Wire {
 public:
  Wire() = default;
  Wire(Octets octets, bool little) : octets_(octets), little_(little) {}

  std::size_t size() const { return octets_.size(); }
  bool little() const { return little_; }
  Octets octets() const { return octets_; }
  std::uint8_t u8(std::size_t at) const { return octets_[at]; }
  std::uint16_t u16(std::size_t at) const {
    const unsigned first = octets_[at];
    const unsigned second = octets_[at + 1];
    return static_cast<std::uint16_t>(little_ ? second << 8U | first : first << 8U | second);
  }
  std::uint32_t u32(std::size_t at) const {
    const std::uint32_t first = u16(at);
    const std::uint32_t second = u16(at + 2);
    return little_ ? second << 16U | first : first << 16U | second;
  }
  // The high half comes first in both octet orders.
  Number number(std::size_t at) const {
    return static_cast<Number>(std::uint64_t{u32(at)} << 32U | u32(at + 4));
  }
  // An entity ID has the same octets in both octet orders (RTPS 2.3 9.3.1.2).
  std::uint32_t entity(std::size_t at) const { return Wire(octets_, false).u32(at); }
  Wire part(std::size_t at, std::size_t length) const {
    return {octets_.subspan(at, length), little_};
  }
  Wire from(std::size_t at) const { return {octets_.subspan(at), little_}; }

 private:
  Octets octets_;
  bool little_ = true;
};

inline constexpr std::size_t align4(std::size_t size) {
  return (size + 3) & ~std::size_t{3};
}

inline Prefix prefix_of(const Guid& guid) {
  Prefix out{};
  std::copy_n(guid.begin(), out.size(), out.begin());
  return out;
}

inline Guid make_guid(const Prefix& prefix, std::uint32_t entity) {
  Guid out{};
  std::copy(prefix.begin(), prefix.end(), out.begin());
  for (unsigned i = 0; i < 4; ++i)
    out[12 + i] = static_cast<std::uint8_t>(entity >> (24 - 8 * i));
  return out;
}

// Entity IDs of builtin writers: RTPS 2.3 table 9.2, DDS-Security 1.1 table 7.
namespace entity {
inline constexpr std::uint32_t kParticipants = 0x000100C2;  // SPDP
inline constexpr std::uint32_t kTopics = 0x000002C2;
inline constexpr std::uint32_t kPublications = 0x000003C2;
inline constexpr std::uint32_t kSubscriptions = 0x000004C2;
inline constexpr std::uint32_t kLiveliness = 0x000200C2;
inline constexpr std::uint32_t kStateless = 0x000201C3;  // authentication handshake
inline constexpr std::uint32_t kSecure = 0xFF000000;     // the protected ones begin with FFh

// A writer of SEDP, protected or not: its samples announce endpoints.
constexpr bool announces_endpoints(std::uint32_t writer) {
  const std::uint32_t plain = writer & ~kSecure;
  return (writer == plain || writer == (kSecure | plain)) &&
         (plain == kPublications || plain == kSubscriptions || plain == kTopics);
}
}  // namespace entity

}  // namespace linegate::dds::guard
