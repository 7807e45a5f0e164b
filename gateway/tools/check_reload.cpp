// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/check_reload.h"

#include <iostream>

#include "gateway/publish/dds_edge.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/runtime/log.h"
#include "gateway/tools/json_text.h"

namespace linegate::gateway {

std::string to_json(const config::PlanDifference& difference) {
  return json_text({{"possible", difference.refusals.empty()},
                    {"changed", difference.changed},
                    {"started", difference.started},
                    {"stopped", difference.stopped},
                    {"unchanged", difference.unchanged},
                    {"other_routes", difference.rerouted}});
}

int check_reload(const std::string& running, const std::string& wanted, bool json) {
  const auto before = config::load(running);
  const auto after = config::load(wanted);
  print(before.diagnostics);
  print(after.diagnostics);
  if (!before.value || !after.value) {
    return kExitUsage;
  }
  const config::PlantIdentity identity =
      identity_of(*before.value, dds_participants_of_profile(before.value->dds_profile));
  const config::PlanDifference found = difference(identity, *after.value);
  print(found.refusals);
  std::cout << (json ? to_json(found) : describe(found)) << '\n';
  return found.refusals.empty() ? kExitOk : kExitUsage;
}

}  // namespace linegate::gateway
