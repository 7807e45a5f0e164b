// SPDX-License-Identifier: Apache-2.0
// `linegate lss LINE ...`: its subcommands and their arguments.
#pragma once

#include <functional>

#include "bridges/console/lss.h"

namespace CLI {
class App;
}

namespace linegate::gateway {

// Adds them; parsing fills request, which must outlive app. ready: called for each subcommand, to
// say what it does.
void add_lss(CLI::App& app, console::LssRequest& request,
             const std::function<void(CLI::App&)>& ready);

}  // namespace linegate::gateway
