// SPDX-License-Identifier: Apache-2.0
#include "gateway/doctor/checks.h"

namespace linegate::doctor {

Findings run_checks(const Observations& seen) {
  Findings found;
#define LINEGATE_RUN_CHECK(name) check_##name(seen, found);
  LINEGATE_CHECKS(LINEGATE_RUN_CHECK)
#undef LINEGATE_RUN_CHECK
  return found;
}

}  // namespace linegate::doctor
