// SPDX-License-Identifier: Apache-2.0
// The certificate authority of a plant, in a folder: ca.crt, ca.key, governance.smime, revoked.crl,
// revoked.names, a subfolder for each identity with the files of files.h, and .issued with the
// certificate of each identity that was issued.
//
// Each function returns an empty text, or the reason of its failure. Private keys (EC P-256) have
// the mode 0600. A failed function leaves no part of a file or of an identity, and can be repeated.
#pragma once

#include <string>

#include "gateway/security/documents.h"

namespace linegate::security {

inline constexpr int kAuthorityDays = 3650;
inline constexpr int kIdentityDays = 365;

// Creates the folder. Fails if it contains a file of an authority. If it fails, removes what it
// made.
std::string init(const std::string& folder);

struct Issue {
  Holder holder;
  int days = kIdentityDays;  // 1 to 3650; the certificate expires with the authority at the latest
  bool renew = false;        // replace an identity, whose old certificate is not revoked
  bool keep_lines = false;   // with renew: of the replaced identity, instead of holder.lines
};
// Makes an identity with the subject CN=name,OU=role,O=linegate. A name has 1 to 64 letters,
// digits, '.', '-' and '_', and is not that of a file of the authority. Fails if the identity
// exists, unless it is revoked or `renew` is set: then its subfolder is replaced in one step. With
// `renew` it fails if there is no such identity, or it has another role. Never replaces what has no
// readable identity.crt. Then removes the name from revoked.names, and copies that file to each
// subfolder; if this fails, the text begins with the fact that it was issued.
std::string issue(const std::string& folder, const Issue& issue);

// Adds the names of the certificates of `name` to revoked.names and the certificates to
// revoked.crl, and copies both to each subfolder, to all others even if one fails. Fails if the
// identity is revoked already, but completes what an earlier failure left.
// Needs no subfolder: the authority keeps each certificate that it issues in .issued/NAME. An older
// authority kept those that a renewal replaced in .replaced/NAME: they are revoked, too.
std::string revoke(const std::string& folder, const std::string& name);

// The same for the identity of that certificate of the authority, in PEM: all certificates of its
// name and this one, even if the authority has not kept it.
std::string revoke_certificate(const std::string& folder, const std::string& file);

}  // namespace linegate::security
