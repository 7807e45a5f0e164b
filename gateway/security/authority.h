// SPDX-License-Identifier: Apache-2.0
// The certificate authority of a plant, in a folder: ca.crt, ca.key, governance.smime, revoked.crl,
// revoked.names, and a subfolder for each identity with the files of files.h.
//
// Each function returns an empty text, or the reason of its failure. Private keys (EC P-256) have
// the mode 0600. A failed function leaves no part of a file or of an identity.
#pragma once

#include <string>

#include "gateway/security/documents.h"

namespace linegate::security {

inline constexpr int kAuthorityDays = 3650;
inline constexpr int kIdentityDays = 365;

// Creates the folder. Fails if it contains an authority.
std::string init(const std::string& folder);

struct Issue {
  Holder holder;
  int days = kIdentityDays;  // 1 to 3650; the certificate expires with the authority at the latest
  bool renew = false;        // replace a valid identity, whose old certificate is not revoked
};
// Makes an identity with the subject CN=name,OU=role,O=linegate. A name has 1 to 64 letters,
// digits, '.', '-' and '_'. Fails if the identity exists, unless it is revoked or `renew` is set:
// then its subfolder is replaced in one step.
std::string issue(const std::string& folder, const Issue& issue);

// Adds the certificates of `name` to revoked.crl and their names to revoked.names, and copies both
// to each subfolder.
std::string revoke(const std::string& folder, const std::string& name);

}  // namespace linegate::security
