// SPDX-License-Identifier: Apache-2.0
// Warnings and errors of Fast DDS itself, as opposed to events of a line.
#pragma once

#include <functional>
#include <string_view>

#include "stack/base/diagnostic.h"

namespace linegate::dds {

using LibraryLog = std::function<void(Severity, std::string_view text)>;

// Passes every later warning and error of the library to `log` instead of printing it. `log` is
// called in a thread of Fast DDS and must only forward the text. An empty function discards them.
void set_library_log(LibraryLog log);

}  // namespace linegate::dds
