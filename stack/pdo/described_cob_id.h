// SPDX-License-Identifier: Apache-2.0
// The COB-ID of a PDO by the device file, or by the pre-defined connection set.
#pragma once

#include "stack/can/cob_id.h"
#include "stack/od/description.h"
#include "stack/pdo/parameters.h"

namespace linegate::pdo {

// Returns sub-index 1 of the communication record, with its bits 30 and 31. If the file has no
// value, or the identifier 000h, the default of CiA 301 7.5.2.35 and 7.5.2.37 applies: the
// identifier of the pre-defined connection set for PDO 1 to 4 of a device with a node-ID, otherwise
// a PDO that is not valid. Not valid also if the sub-index does not exist.
can::CobId described_cob_id(const od::DeviceDescription& device, PdoKind kind,
                            std::uint16_t number);

// Sets each COB-ID that the file leaves to the pre-defined connection set, as a formula of the
// node-ID, so that a dictionary created from the description has it.
void complete_cob_ids(od::DeviceDescription& device);

}  // namespace linegate::pdo
