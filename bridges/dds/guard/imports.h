// SPDX-License-Identifier: Apache-2.0
// The functions that a loaded shared library imports (ELF, 64 bit).
#pragma once

#include <string_view>

namespace linegate::dds::guard {

// Replaces the address that the library has for a function that it imports; other libraries are
// unaffected. library: the begin of its file name, as "libfastrtps.so". Returns false if
// it is not loaded, does not import the function, or its memory cannot be changed.
bool replace_import(std::string_view library, std::string_view function, void* replacement);

}  // namespace linegate::dds::guard
