// SPDX-License-Identifier: Apache-2.0
// Where a test finds files of the repository and programs of this build. linegate_paths() of
// cmake/LinegateTargets.cmake defines those that a program uses; as options of the compiler they
// would make every clone compile its tests anew.
#pragma once

#include <string>

namespace linegate::paths {

extern const char* const kRepository;
extern const char* const kScenarios;  // tests/plant/scenarios
extern const char* const
    kLoopbackProfiles;  // QoS profiles of DDS, for the loopback interface alone
extern const char* const kDdsPeer;
extern const char* const kDdsFaults;
extern const char* const kLinegated;
extern const char* const kMakeIdentities;

// name: within the repository, as "plant.yaml".
inline std::string in_repository(const std::string& name) {
  return std::string(kRepository) + '/' + name;
}

}  // namespace linegate::paths
