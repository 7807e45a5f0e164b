// SPDX-License-Identifier: Apache-2.0
#include "gateway/security/files.h"

#include <filesystem>

namespace linegate::security {

Files files_in(const std::string& folder) {
  const auto path = [at = std::filesystem::absolute(folder)](const char* file) {
    return (at / file).string();
  };
  return {path(kCaFile),          path(kCertificateFile), path(kKeyFile),
          path(kGovernanceFile),  path(kPermissionsFile), path(kRevocationsFile),
          path(kRevokedNamesFile)};
}

}  // namespace linegate::security
