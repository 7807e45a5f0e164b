// SPDX-License-Identifier: Apache-2.0
// The network part of a participant profile and the choice beside it, for a diagnosis.
#pragma once

#include <string>

#include "bridges/dds/network_choice.h"
#include "bridges/dds/observed.h"

namespace linegate::dds {

// file: as load_profiles(). Empty if the profiles are unusable (check_profiles()). A choice that
// cannot be applied is left out. Opens no socket.
NetworkProfile network_profile(const std::string& file, const NetworkChoice& choice = {});

}  // namespace linegate::dds
