// SPDX-License-Identifier: Apache-2.0
// The identity of a client for DDS-Security.
#pragma once

#include <string>
#include <vector>

#include "bridges/dds/security.h"
#include "stack/base/diagnostic.h"

namespace linegate::gateway {

// Sets the identity of a client from the files in that folder (gateway/security/files.h). requests:
// the client sends requests, which an identity of role viewer must not. Returns the findings; one
// that is an error makes the identity unusable.
std::vector<Diagnostic> use_identity(const std::string& folder, bool requests, dds::Security& out);

}  // namespace linegate::gateway
