// SPDX-License-Identifier: Apache-2.0
// When the certificates of the other participants expire. Fast DDS 2.9.1 checks a certificate when
// it authenticates a participant, and never again.
//
// A participant must send its certificate to be authenticated, and the certificate has the
// signature of the authority, so neither a missing file nor a lie of the participant hides its end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <ctime>
#include <mutex>
#include <set>
#include <span>
#include <string>

#include "gateway/security/openssl.h"

namespace linegate::security {

class PeerCertificates {
 public:
  static constexpr std::size_t kMost = 1'024;     // times, and certificates that were verified
  static constexpr unsigned kMostPerSecond = 50;  // new certificates: each costs about 0.1 ms

  // ca_file: kCaFile of the own identity. Without a readable one, note() is always false.
  explicit PeerCertificates(const std::string& ca_file) : ca_(read_certificate(ca_file)) {}

  // pem: begins with a certificate in PEM. Returns false if it is no certificate of the authority,
  // or if there were more than kMostPerSecond: the message must not be passed on. From any thread.
  bool note(std::span<const std::uint8_t> pem, std::time_t now);

  // The earliest end of validity of the certificates that were valid when they were noted; 0:
  // there were none. From any thread.
  std::time_t next_expiry() const;

 private:
  bool is_verified(X509* certificate, std::time_t now);

  const Certificate ca_;
  mutable std::mutex mutex_;
  std::set<std::string> verified_;  // SHA-256 of each
  std::set<std::time_t> expiries_;
  std::time_t second_ = 0;
  unsigned in_second_ = 0;  // number of new certificates
};

}  // namespace linegate::security
