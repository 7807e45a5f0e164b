// SPDX-License-Identifier: Apache-2.0
// The COB-ID of a PDO as the device file gives it, or leaves it to the pre-defined connection set.
#pragma once

#include "stack/can/cob_id.h"
#include "stack/od/description.h"
#include "stack/pdo/parameters.h"

namespace linegate::pdo {

// Sub-index 1 of the communication record, with its bits 30 and 31. Where the file has no value, or
// the identifier 000h, the default of CiA 301 7.5.2.35 and 7.5.2.37 counts: the identifier of the
// pre-defined connection set for PDO 1 to 4 of a device with a node-ID, and for all others a PDO
// that is not valid. Not valid, too, if there is no such sub-index.
can::CobId described_cob_id(const od::DeviceDescription& device, PdoKind kind,
                            std::uint16_t number);

// Gives each COB-ID that the file leaves to the pre-defined connection set its value, so that a
// dictionary made of the description has it; a formula of the node-ID.
void complete_cob_ids(od::DeviceDescription& device);

}  // namespace linegate::pdo
