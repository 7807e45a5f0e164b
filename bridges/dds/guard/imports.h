// SPDX-License-Identifier: Apache-2.0
// The functions that a loaded shared library imports (ELF, 64 bit).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace linegate::dds::guard {

// Replaces the address that the library has for a function that it imports; other libraries are
// unaffected. library: the begin of its file name, as "libfastrtps.so". Returns false if
// it is not loaded, does not import the function, or its memory cannot be changed.
bool replace_import(std::string_view library, std::string_view function, void* replacement);

// Whether the page of the address is read-only because of a segment PT_GNU_RELRO at `begin`. page:
// the size of pages. The dynamic linker of glibc protects whole pages: from the one in which the
// segment begins up to, and without, the one in which it ends (_dl_protect_relro).
bool is_relro(std::uintptr_t address, std::uintptr_t begin, std::size_t size, std::size_t page);

}  // namespace linegate::dds::guard
