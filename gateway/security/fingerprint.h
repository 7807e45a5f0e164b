// SPDX-License-Identifier: Apache-2.0
// The certificate of a participant by its GUID.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "gateway/security/documents.h"

namespace linegate::security {

using Fingerprint = std::array<std::uint8_t, 6>;

// The first octets of the GUID prefix of a participant whose certificate was issued (authority.h)
// with that name and role: a 1 bit and 47 bits of SHA-256 of the subject in DER (DDS-Security 1.1
// 9.3.3). Both sides of an authentication check them.
Fingerprint fingerprint_of(std::string_view name, Role role);

// Whether an authenticated participant with that GUID prefix has a certificate of that role (as in
// name(Role)) and name.
bool is_holder(const std::array<std::uint8_t, 12>& prefix, std::string_view role,
               std::string_view name);

}  // namespace linegate::security
