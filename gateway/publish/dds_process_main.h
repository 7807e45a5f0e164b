// SPDX-License-Identifier: Apache-2.0
// What the processes with DDS have in common: their privileges, log and end.
#pragma once

#include <string_view>

#include "stack/base/diagnostic.h"

namespace linegate::dds {
struct Security;
}  // namespace linegate::dds

namespace linegate::gateway {

// One line of the parent's log.
void write_line(Severity severity, std::string_view text);

// Gives up privileges, limits memory and the files that the process may write, and passes messages
// of the DDS library to the log. Call it first. Returns false after it has logged the reason.
bool enter_dds_process();

// Sets the functions that a message cannot contain: those about the certificates of other
// participants, which pass this process only. No effect without DDS-Security.
void add_security_functions(dds::Security& to);

// Runs the main function of the process of that name, and ends the process.
[[noreturn]] void run_process(const char* name, int (*run)());

}  // namespace linegate::gateway
