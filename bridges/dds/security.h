// SPDX-License-Identifier: Apache-2.0
// DDS-Security of a participant, and the rights that its partitions express.
//
// In a secured domain, requests (OutputWrite, CommandRequest) are written in the partition
// GATEWAY/LINE/RIGHT/NAME, and the replies to an identity in GATEWAY//RIGHT/NAME; everything else
// is in the default partition. The permissions of each certificate name the partitions that it may
// write in, and every peer checks them. So the partition of a matched writer proves right and name
// of its certificate.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/dds/values.h"

namespace linegate::dds {

struct Security {
  // Paths of files in PEM; the documents are S/MIME. All are set, or none: without DDS-Security.
  std::string ca;
  std::string certificate;
  std::string key;
  std::string governance;
  std::string permissions;
  std::string revocations;
  // Of a gateway: the partition of its requests, with a wildcard: "plant/*".
  std::string request_partition;
  // Of a client that sends requests: the end of its partitions, "operator/alice".
  std::string right;
  // Whether a participant with that GUID prefix has the certificate of that right and name; without
  // a function: always. A gateway calls it for the right and name of a request; a client, and a
  // gateway that follows lines of others, for "gateway" and the gateway that a sample names, and
  // ignores the sample if not.
  std::function<bool(const std::array<std::uint8_t, 12>& prefix, std::string_view right,
                     std::string_view name)>
      is_holder;
  // Of a gateway: whether that name of that right is revoked, also for a certificate that was
  // issued later; without a function: none is. Called by the thread that polls.
  std::function<bool(std::string_view right, std::string_view name)> is_revoked;

  // Of a gateway: whether a message of the authentication with that certificate in PEM, and octets
  // behind it, is accepted; without a function: always. Only with a guard. Called from any thread.
  std::function<bool(std::span<const std::uint8_t> pem)> accepts_certificate;
  // The earliest end of validity of these certificates in s since 1970; 0: there were none.
  std::function<std::int64_t()> next_expiry;

  bool enabled() const { return !certificate.empty(); }
};

// Of the files of an identity; Files has members of the same names (security::Files of the gateway,
// which this bridge does not know).
template <class Files>
Security security_with(const Files& files) {
  return {.ca = files.ca,
          .certificate = files.certificate,
          .key = files.key,
          .governance = files.governance,
          .permissions = files.permissions,
          .revocations = files.revocations};
}

// The partition of requests to a line; an empty line: to the gateway itself.
std::string request_partition(std::string_view gateway, std::string_view line,
                              std::string_view right);

// The partition of all replies of a gateway to a client with that right, "operator/alice". Its line
// is empty, so that a gateway needs one writer for each identity.
std::string reply_partition(std::string_view gateway, std::string_view right);
// The partition with wildcards in which this client reads the replies of all gateways.
std::string replies_to(std::string_view right);

struct Claim {
  ClientRight right = ClientRight::none;
  std::string name;
};
// What a writer with these partitions may send to that line. Nothing if none of them is of the line
// and has a known right, or if any has a wildcard: such a writer matches readers of lines that its
// partition does not name.
std::optional<Claim> claim_of(const std::vector<std::string>& partitions, std::string_view gateway,
                              std::string_view line);

}  // namespace linegate::dds
