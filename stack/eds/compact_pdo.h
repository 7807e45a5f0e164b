// SPDX-License-Identifier: Apache-2.0
// CompactPDO of CiA 306: PDOs that exist although no section describes them; private to stack/eds.
#pragma once

#include "stack/eds/data_sheet.h"
#include "stack/eds/variable.h"

namespace linegate::eds {

// Completes the PDO records of sheet.device if DeviceInfo has a CompactPDO mask. A PDO that is
// described in part gets the missing of its two records; beyond that as many are added, lowest
// numbers first, that there are NrOfRXPDO and NrOfTXPDO. COB-IDs are those of the predefined
// connection set, the mappings are empty and have room for 64 entries.
void add_compact_pdos(const Ini& ini, DataSheet& sheet, Context& context);

}  // namespace linegate::eds
