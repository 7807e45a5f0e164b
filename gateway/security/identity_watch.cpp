// SPDX-License-Identifier: Apache-2.0
#include "gateway/security/identity_watch.h"

#include <array>
#include <utility>

#include "gateway/security/openssl.h"

namespace linegate::security {

IdentityWatch::IdentityWatch(Files files) : files_(std::move(files)), used_(read()), seen_(used_) {
}

std::string IdentityWatch::due(Instant now, std::time_t utc, std::time_t next_expiry) {
  if (!was_read_ || now - read_at_ >= kPeriod) {
    if (std::string list = read(); !list.empty())
      seen_ = std::move(list);
    was_read_ = true;
    read_at_ = now;
  }
  if (was_replaced_ && now - replaced_ < kPause)
    return {};
  if (seen_ != used_)
    return std::string(kRevocationsFile) + " has changed";
  if (next_expiry != 0 && utc > next_expiry)
    return "the certificate of a participant has expired";
  return {};
}

void IdentityWatch::note_replaced(Instant now) {
  used_ = seen_;
  was_replaced_ = true;
  replaced_ = now;
}

// SHA-256 of the list; empty if a participant cannot use it.
std::string IdentityWatch::read() const {
  const Certificate ca = read_certificate(files_.ca);
  const RevocationList list = read_revocations(files_.revocations);
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  if (!ca || !list || X509_CRL_verify(list.get(), X509_get0_pubkey(ca.get())) != 1 ||
      X509_CRL_digest(list.get(), EVP_sha256(), digest.data(), &size) != 1)
    return {};
  return {digest.begin(), digest.begin() + size};
}

}  // namespace linegate::security
