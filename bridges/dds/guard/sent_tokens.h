// SPDX-License-Identifier: Apache-2.0
// The key material that a secured participant has sent (DDS-Security 1.1 7.4.4.3,
// BuiltinParticipantVolatileMessageSecureWriter).
//
// Fast DDS 2.9.1 keeps each of these samples for ever, though their writer is volatile (its issue
// 4553): one for each pair of a writer and a reader that were ever matched, so 0.7 MB for each
// console that joins a gateway with 64 lines.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace linegate::dds::guard {

// From now on each participant that is created in this process removes the samples that all
// readers have acknowledged, when it sends the next one. Returns false if the calls of the library
// cannot be replaced.
bool drop_sent_tokens();

// The number of samples that the participant with this GUID prefix keeps. It must exist, and have
// been created after drop_sent_tokens().
std::size_t kept_tokens(const std::array<std::uint8_t, 12>& prefix);

}  // namespace linegate::dds::guard
