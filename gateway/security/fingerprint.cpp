// SPDX-License-Identifier: Apache-2.0
#include "gateway/security/fingerprint.h"

#include <algorithm>
#include <string>

#include "gateway/security/openssl.h"

namespace linegate::security {

Fingerprint fingerprint_of(std::string_view name, Role role) {
  const Name subject = make_subject(name, security::name(role));
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  X509_NAME_digest(subject.get(), EVP_sha256(), digest.data(), &size);
  Fingerprint out{};
  unsigned above = 1;
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = static_cast<std::uint8_t>(above << 7U | digest[i] >> 1U);
    above = digest[i] & 1U;
  }
  return out;
}

bool is_holder(const std::array<std::uint8_t, 12>& prefix, std::string_view role,
               std::string_view name) {
  const auto known = parse_role(role);
  if (!known)
    return false;
  const Fingerprint expected = fingerprint_of(name, *known);
  return std::equal(expected.begin(), expected.end(), prefix.begin());
}

}  // namespace linegate::security
