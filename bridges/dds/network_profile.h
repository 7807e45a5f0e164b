// SPDX-License-Identifier: Apache-2.0
// The network part of a participant profile, for a diagnosis.
#pragma once

#include <string>

#include "bridges/dds/observed.h"

namespace linegate::dds {

// file: as load_profiles(). Empty if the profiles are unusable (check_profiles()). Opens no socket.
NetworkProfile network_profile(const std::string& file);

}  // namespace linegate::dds
