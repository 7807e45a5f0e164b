// SPDX-License-Identifier: Apache-2.0
#include "gateway/security/fingerprint.h"

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

}  // namespace linegate::security
