// SPDX-License-Identifier: Apache-2.0
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

struct LoadedProfiles {
  std::string origin;  // name of the file, or "(built-in ...)"
  std::string text;    // XML
};

// Loads `file`, or where that is empty the installed file, or where there is none the built-in
// copy. Without a value, a diagnostic names the file, the line where it is known, and the reason.
// A participant profile that keeps multicast locators of readers is refused, see
// Endpoints::create_participant().
// Fast DDS keeps profiles by name for the whole process: a second, different file is refused.
std::optional<LoadedProfiles> load_profiles(const std::string& file,
                                            std::vector<Diagnostic>& diagnostics);

// Loads likewise, and reports what makes a profile unusable (errors) or dangerous with Fast DDS 2.9
// (warnings), before anything is created with it. Opens no socket.
std::vector<Diagnostic> check_profiles(const std::string& file);

// Where an empty name of a file leads: a path, or "(built-in ...)".
std::string profiles_in_use(const std::string& file);

}  // namespace linegate::dds
