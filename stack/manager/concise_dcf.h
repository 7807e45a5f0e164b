// SPDX-License-Identifier: Apache-2.0
// Concise DCF: the writes that configure a device, as object 1F22h (CiA 302-3) and files hold them.
//
//   U32 count, then so many times { U16 index, U8 sub-index, U32 size in bytes, data }
//
// little-endian, without gaps. No bytes at all: nothing to do.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "stack/base/result.h"
#include "stack/manager/plan.h"

namespace linegate::manager {

// Empty if there are no writes.
std::vector<std::byte> write_concise_dcf(std::span<const ObjectWrite> writes);

// The writes in their order. Fails with length_mismatch if count and sizes do not agree with the
// number of bytes: nothing of it can be trusted then.
Result<std::vector<ObjectWrite>> read_concise_dcf(std::span<const std::byte> data);

}  // namespace linegate::manager
