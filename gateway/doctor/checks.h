// SPDX-License-Identifier: Apache-2.0
// The checks of `linegate doctor`, in the order of their findings.
//
// A check is a pure function: it adds a finding for each cause that the observations show, with
// what was seen as its evidence. A new check is one file NAME_check.cpp and one entry in the list.
#pragma once

#include "gateway/doctor/finding.h"
#include "gateway/doctor/observations.h"

namespace linegate::doctor {

// check_silence is last: it runs only if no other check has found more than an interface that is
// down.
#define LINEGATE_CHECKS(CHECK) \
  CHECK(profile)               \
  CHECK(identity)              \
  CHECK(servers)               \
  CHECK(interfaces)            \
  CHECK(multicast)             \
  CHECK(domain)                \
  CHECK(peers)                 \
  CHECK(security)              \
  CHECK(firewall)              \
  CHECK(qos)                   \
  CHECK(types)                 \
  CHECK(partitions)            \
  CHECK(fan_out)               \
  CHECK(names)                 \
  CHECK(clocks)                \
  CHECK(limits)                \
  CHECK(silence)

#define LINEGATE_DECLARE_CHECK(name) void check_##name(const Observations& seen, Findings& found);
LINEGATE_CHECKS(LINEGATE_DECLARE_CHECK)
#undef LINEGATE_DECLARE_CHECK

// The findings of all checks.
Findings run_checks(const Observations& seen);

}  // namespace linegate::doctor
