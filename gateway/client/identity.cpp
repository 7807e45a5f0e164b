// SPDX-License-Identifier: Apache-2.0
#include "gateway/client/identity.h"

#include <ctime>

#include "gateway/security/files.h"
#include "gateway/security/fingerprint.h"
#include "gateway/security/identity_check.h"

namespace linegate::gateway {

std::vector<Diagnostic> use_identity(const std::string& folder, bool requests, dds::Security& out) {
  auto found = security::check_identity(folder, std::time(nullptr));
  const auto identity = security::identity_of(folder);
  if (has_errors(found) || !identity)
    return found;
  const bool may_request =
      identity->role == security::Role::operator_ || identity->role == security::Role::engineer;
  const security::Files files = security::files_in(folder);
  if (requests && !may_request) {
    found.push_back(
        {Severity::error, files.certificate, 0, 0,
         "is of role " + std::string(security::name(identity->role)) +
             ", which sends no commands: use an identity of role operator or engineer"});
  }
  out = dds::security_with(files);
  out.is_holder = security::is_holder;
  out.right = std::string(security::name(identity->role)) + "/" + identity->name;
  return found;
}

}  // namespace linegate::gateway
