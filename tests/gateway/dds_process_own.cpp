// SPDX-License-Identifier: Apache-2.0
// The cases of this program run with DDS in a process of its own, which linegated is started as.
#include "tests/gateway/plans.h"
#include "tests/paths.h"

namespace linegate::gateway {
namespace {

const bool kIsOwnProcess = [] {
  place_of_dds() = {.process = "own", .program = paths::kLinegated};
  return true;
}();

}  // namespace
}  // namespace linegate::gateway
