// SPDX-License-Identifier: Apache-2.0
// QoS is defined in an XML file of Fast DDS profiles that an operator can change, not in code.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stack/base/diagnostic.h"

namespace linegate::dds {

// Profile of the participant. The profiles of writers and readers have the names of their topics.
inline constexpr const char* kParticipantProfile = "linegate";

// deploy/dds/linegate-profiles.xml at build time.
std::string_view built_in_profiles();

struct LoadedProfiles {
  std::string origin;  // name of the file, or "(built-in ...)"
  std::string text;    // XML
};

// Loads `file`; if it is empty, the installed file; if that does not exist, the built-in copy.
// Without a value, a diagnostic names the file, the line if it is known, and the reason. A
// participant profile that keeps multicast locators of readers is refused, see
// Endpoints::create_participant(). Fast DDS stores profiles by name for the whole process, so a
// second, different file is refused.
std::optional<LoadedProfiles> load_profiles(const std::string& file,
                                            std::vector<Diagnostic>& diagnostics);

// Loads the same file, and reports what makes a profile unusable (errors) or dangerous with Fast
// DDS 2.9 (warnings), before anything is created from it. Opens no socket.
std::vector<Diagnostic> check_profiles(const std::string& file);

// The file that load_profiles() would load: a path, or "(built-in ...)".
std::string profiles_in_use(const std::string& file);

// Loads the same file. The limit of other participants: allocation/total_participants/maximum,
// which includes the own one; kMostParticipants if it is not set, or the file is unusable.
std::size_t participants_of_profile(const std::string& file);

}  // namespace linegate::dds
