// SPDX-License-Identifier: Apache-2.0
// The result of a boot process as an event, and the meaning of its finding.
#pragma once

#include <cstdint>

#include "stack/base/abort_code.h"
#include "stack/base/event.h"
#include "stack/base/time.h"
#include "stack/manager/state.h"

namespace linegate::manager {

// The result of a boot slave process, as event::BootResult.
Event boot_result(std::uint8_t node, char letter, const BootFinding& finding, Instant now);

// The finding in an event of boot_result().
BootFinding finding_of(const event::BootResult& result);

// The abort code is 0503 0000h or 0504 0000h to 0504 0004h, with which either side reports that the
// transfer went out of step. It is not a refusal: a repeated transfer may succeed.
bool is_communication_error(AbortCode abort);

// The node refused a transfer that the boot process needs. A node that stopped answering did not
// refuse; one that reported a communication error did only if it repeated it (kRefusals in
// boot_slave.cpp).
bool is_refusal(const BootFinding& finding);

}  // namespace linegate::manager
