// SPDX-License-Identifier: Apache-2.0
// Checks parameter lists (RTPS 2.3 9.4.2.11) and the CDR within the parameters of discovery
// samples: no length or count may exceed the available octets. Pure functions without allocation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "bridges/dds/guard/reason.h"
#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {

inline constexpr std::uint16_t kSentinel = 0x0001;  // ends a list
inline constexpr std::size_t kParameterHeader = 4;  // ID, length

// Calls each(position, ID, value) for the parameters of a checked list, up to its sentinel.
template <class Each>
void each_parameter(const Wire& list, Each each) {
  for (std::size_t at = 0; list.size() - at >= kParameterHeader;) {
    const std::uint16_t id = list.u16(at);
    const std::size_t length = list.u16(at + 2);
    if (id == kSentinel || length > list.size() - at - kParameterHeader)
      return;
    each(at, id, list.part(at + kParameterHeader, length));
    at += kParameterHeader + length;
  }
}

// The prefix of the GUIDs and key hashes in a parameter list.
struct Owner {
  std::optional<Prefix> prefix;
  bool several = false;

  void add(const Prefix& it) {
    several = several || (prefix && *prefix != it);
    prefix = it;
  }
  bool is(const Prefix& it) const { return prefix == it && !several; }
  bool may_be(const Prefix& it) const { return !prefix || is(it); }
};

struct InlineQos {
  std::size_t length = 0;  // octets, sentinel included; 0 = malformed
  // The sample disposes of or unregisters its instance (RTPS 2.3 9.6.3.9)
  bool ends_instance = false;
  std::optional<Guid> key;  // key hash (RTPS 2.3 9.6.3.8); of an endpoint's announcement: its GUID
  Owner instance;
};
// Reads the inline QoS at the beginning of `rest`.
InlineQos read_inline_qos(const Wire& rest);

// The announcement of a participant or an endpoint (RTPS 2.3 table 9.14).
struct Announcement {
  Wire list;
  std::uint32_t lease = 100;  // s, of a participant; default of RTPS 2.3 table 9.14
  std::optional<Guid> endpoint;
  std::optional<Guid> persistence;  // of a writer: the GUID of its history (Fast DDS)
  Owner owner;
  bool reliable = false;  // a reader without PID_RELIABILITY is best-effort
};

// Checks the serialized payload of a sample of a builtin writer that carries a parameter list.
bool check_parameter_list(const Wire& payload, Announcement& out);

// Turns the parameters TypeIdV1, TypeObjectV1 and TypeInformation (DDS-XTypes 1.2 7.6.3.2.2) of a
// checked list, up to its sentinel, into padding (RTPS 2.3 9.6.2.2.1). Their CDR is not checked,
// and the library allocates as many elements as they claim.
void pad_types(std::span<std::uint8_t> list, bool little);
void pad_key_hash(std::span<std::uint8_t> list, bool little);

// Check the payload of ParticipantMessageData (RTPS 2.3 9.6.2.1) and ParticipantStatelessMessage
// (DDS-Security 1.1 7.4.3).
bool check_liveliness_message(const Wire& payload);
bool check_stateless_message(const Wire& payload);

}  // namespace linegate::dds::guard
