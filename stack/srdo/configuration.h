// SPDX-License-Identifier: Apache-2.0
// The order of the writes that configure the SRDOs of a device (EN 50325-5).
#pragma once

#include <vector>

#include "stack/manager/object_write.h"
#include "stack/od/description.h"

namespace linegate::srdo {

// Moves the writes to 1300h..13FFh to the end of `writes`, in the order that a device accepts:
// 13FEh to 0, which makes the configuration invalid; for each SRDO that is written its direction 0,
// its mapping, its other parameters and its direction, then its signature in 13FFh; last, A5h to
// 13FEh. Steps that are not among the writes are added if the device has a writable object for
// them; the signature is computed from the parameters that the device then has. Of several writes
// to an object the last one counts, and each object is written. No effect without a write to
// 1300h..13FDh.
void order_writes(const od::DeviceDescription& device, std::vector<manager::ObjectWrite>& writes);

}  // namespace linegate::srdo
