// SPDX-License-Identifier: Apache-2.0
// What a configuration says that is no mistake in itself, and hardly meant so.
#pragma once

#include "gateway/config/plant.h"

namespace linegate::config {

// Adds them to the diagnostics, as warnings: PDOs that wait for a SYNC which nobody produces; error
// control that is written to an object which the device file does not have; nodes without error
// control; device files with vendor-ID 0. Nothing for a
// configuration that is not good.
void add_hints(Loaded<Plant>& loaded);

}  // namespace linegate::config
