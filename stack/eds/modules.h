// SPDX-License-Identifier: Apache-2.0
// Modular devices (CiA 306-1, chapter 8): what each kind of module brings, and what the connected
// ones make of the device; private to stack/eds.
#pragma once

#include <map>

#include "stack/eds/data_sheet.h"
#include "stack/eds/sections.h"
#include "stack/eds/variable.h"

namespace linegate::eds {

// [SupportedModules] and all sections that begin with M and a number.
std::vector<Module> read_modules(const Ini& ini,
                                 const std::map<std::uint16_t, ModuleSections>& sections,
                                 Context& context);

// [ConnectedModules]: numbers of modules in the order of their places.
std::vector<std::uint16_t> read_connected_modules(const Ini& ini, Report& report);

// Adds the objects of the connected modules to sheet.device. An object or sub-index that the file
// describes itself counts more. Modules nobody describes are reported.
void connect_modules(const Ini& ini, DataSheet& sheet, Context& context);

}  // namespace linegate::eds
