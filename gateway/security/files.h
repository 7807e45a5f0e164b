// SPDX-License-Identifier: Apache-2.0
// The files of an identity.
#pragma once

#include <string>

namespace linegate::security {

inline constexpr const char* kCaFile = "ca.crt";                      // of the authority
inline constexpr const char* kCertificateFile = "identity.crt";       // of the participant
inline constexpr const char* kKeyFile = "identity.key";               // its key, mode 0600
inline constexpr const char* kGovernanceFile = "governance.smime";    // signed by the authority
inline constexpr const char* kPermissionsFile = "permissions.smime";  // signed by the authority
inline constexpr const char* kRevocationsFile = "revoked.crl";        // signed by the authority

// Of the authority alone: no identity has it.
inline constexpr const char* kCaKeyFile = "ca.key";

// "ROLE/NAME" of each revoked identity, for running gateways. A gateway does not start without it.
inline constexpr const char* kRevokedNamesFile = "revoked.names";

struct Files {
  std::string ca, certificate, key, governance, permissions, revocations, revoked_names;
};
// Absolute paths: the DDS library reads them as URIs.
Files files_in(const std::string& folder);

}  // namespace linegate::security
