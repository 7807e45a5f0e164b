// SPDX-License-Identifier: Apache-2.0
// OutputWrite of the contract from and to the stack's. gateway, line, client and incarnation are
// left alone.
#pragma once

#include <linegate.h>

#include "bridges/dds/values.h"
#include "stack/line/output_write.h"

namespace linegate::dds {

// False if it is beyond the contract's bounds.
bool to_wire(const line::OutputWrite& from, v1::OutputWrite& to);

// What a stranger sent: `refusal` is none, or why it cannot be understood, with `why` in words.
struct OutputCheck {
  line::OutputRefusal refusal = line::OutputRefusal::none;
  const char* why = "";
};
OutputCheck from_wire(const v1::OutputWrite& from, line::OutputWrite& to);

}  // namespace linegate::dds
