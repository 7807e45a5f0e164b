// SPDX-License-Identifier: Apache-2.0
// Converts between OutputWrite of the contract and the stack's. gateway, line, client and
// incarnation are unchanged.
#pragma once

#include <linegate.h>

#include "bridges/dds/values.h"
#include "stack/line/output_write.h"

namespace linegate::dds {

// Returns false if the values exceed the contract's bounds.
bool to_wire(const line::OutputWrite& from, v1::OutputWrite& to);

// Result of checking a received sample: `refusal` is none, or the reason why it is malformed, which
// `why` describes.
struct OutputCheck {
  line::OutputRefusal refusal = line::OutputRefusal::none;
  const char* why = "";
};
// Of the members that all writes have.
OutputCheck check_watchdog(std::uint8_t reactions, Duration watchdog);
OutputCheck from_wire(const v1::OutputWrite& from, line::OutputWrite& to);

}  // namespace linegate::dds
