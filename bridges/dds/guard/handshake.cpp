// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/handshake.h"

#include <algorithm>
#include <string_view>

namespace linegate::dds::guard {
namespace {

// RFC 7468 3. OpenSSL also reads "X509 CERTIFICATE" and "TRUSTED CERTIFICATE", which Fast DDS never
// sends.
constexpr std::string_view kBegin = "-----BEGIN ";
constexpr std::string_view kBeginOfCertificate = "-----BEGIN CERTIFICATE-----";

}  // namespace

std::optional<Octets> certificate_in(Octets message) {
  const auto find = [](Octets in) {
    return std::search(in.begin(), in.end(), kBegin.begin(), kBegin.end());
  };
  const auto begin = find(message);
  if (begin == message.end())
    return Octets();
  const Octets rest = message.subspan(static_cast<std::size_t>(begin - message.begin()));
  const Octets behind = rest.subspan(kBegin.size());
  const bool one = find(behind) == behind.end();
  const bool is_certificate =
      rest.size() >= kBeginOfCertificate.size() &&
      std::equal(kBeginOfCertificate.begin(), kBeginOfCertificate.end(), rest.begin());
  return one && is_certificate ? std::optional(rest) : std::nullopt;
}

}  // namespace linegate::dds::guard
