// SPDX-License-Identifier: Apache-2.0
// Protects the files of the gateway from a process that was taken over and has the same user.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace linegate::gateway {

enum class WriteLimit : std::uint8_t {
  set,
  unavailable,  // the kernel has no Landlock, or a filter of the service forbids its system calls
  refused       // the kernel has it, and refuses the rules
};

// An entry of the log for WriteLimit::unavailable.
inline constexpr std::string_view kWritesNotLimited =
    "the kernel has no Landlock (CONFIG_SECURITY_LANDLOCK, lsm=landlock): the DDS process may "
    "write "
    "each file that its user may write";

// From now on, this process, its threads that are started later, and its children cannot open a
// file for writing, truncate, create, rename, link or remove one outside of the folders (Landlock,
// landlock(7)): the calls fail with EACCES. In the folders, regular files can be written, created
// and removed. Reading, and descriptors that are open, are unaffected. Requires no_new_privs, and a
// process with one thread. A kernel before 6.2 (ABI 3) does not limit truncation by this:
// protect_other_processes() does. folders: absolute paths; one that does not exist is ignored.
WriteLimit restrict_writing(const std::vector<const char*>& folders);

}  // namespace linegate::gateway
