// SPDX-License-Identifier: Apache-2.0
#include "gateway/security/peer_certificates.h"

#include <array>
#include <iterator>

namespace linegate::security {

bool PeerCertificates::note(std::span<const std::uint8_t> pem, std::time_t now) {
  const Bio in(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())));
  const Certificate certificate(PEM_read_bio_X509(in.get(), nullptr, nullptr, nullptr));
  std::tm parts{};
  if (!ca_ || !certificate || ASN1_TIME_to_tm(X509_get0_notAfter(certificate.get()), &parts) != 1)
    return false;
  const std::lock_guard lock(mutex_);
  if (!is_verified(certificate.get(), now))
    return false;
  const std::time_t expiry = ::timegm(&parts);
  if (expiry <= now)
    return true;  // the library refuses it
  expiries_.insert(expiry);
  if (expiries_.size() > kMost)
    expiries_.erase(std::prev(expiries_.end()));
  return true;
}

std::time_t PeerCertificates::next_expiry() const {
  const std::lock_guard lock(mutex_);
  return expiries_.empty() ? 0 : *expiries_.begin();
}

bool PeerCertificates::is_verified(X509* certificate, std::time_t now) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  if (X509_digest(certificate, EVP_sha256(), digest.data(), &size) != 1)
    return false;
  const std::string key(digest.begin(), digest.begin() + size);
  if (verified_.contains(key))
    return true;
  if (now != second_) {
    second_ = now;
    in_second_ = 0;
  }
  if (++in_second_ > kMostPerSecond || X509_verify(certificate, X509_get0_pubkey(ca_.get())) != 1)
    return false;
  if (verified_.size() >= kMost)
    verified_.clear();
  verified_.insert(key);
  return true;
}

}  // namespace linegate::security
