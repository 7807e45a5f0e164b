// QoS comes from an XML file of Fast DDS profiles that an operator can change, never from code.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stack/base/diagnostic.h"

namespace linegate::dds {

// Profile of the participant; those of writers and readers are named like their topics.
inline constexpr const char* kParticipantProfile = "linegate";

// deploy/dds/linegate-profiles.xml as it was when this was built.
std::string_view built_in_profiles();

// Loads `file`, or where that is empty the installed file, or where there is none the built-in
// copy. Gives the name of what was loaded; without one, a diagnostic names the file and the reason.
// Fast DDS keeps profiles by name for the whole process: a second, different file is refused.
std::optional<std::string> load_profiles(const std::string& file,
                                         std::vector<Diagnostic>& diagnostics);

}  // namespace linegate::dds
