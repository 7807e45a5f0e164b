// SPDX-License-Identifier: Apache-2.0
// What Fast DDS itself has to say: warnings and errors of the library, not events of a line.
#pragma once

#include <functional>
#include <string_view>

#include "stack/base/diagnostic.h"

namespace linegate::dds {

using LibraryLog = std::function<void(Severity, std::string_view text)>;

// Gives every later warning and error of the library to `log` instead of printing it. Called from a
// thread of Fast DDS: only hand the text on. An empty function keeps them quiet.
void set_library_log(LibraryLog log);

}  // namespace linegate::dds
