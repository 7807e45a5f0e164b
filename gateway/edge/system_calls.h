// SPDX-License-Identifier: Apache-2.0
// Protects the gateway from a process that was taken over and has the same user.
#pragma once

namespace linegate::gateway {

// From now on, the system calls that signal, trace, limit or schedule another process, execute a
// program, create namespaces, truncate a file by its path, or change the owner or mode of one by
// its path fail with EPERM in this process, in all its threads that are started later, and in its
// children (seccomp(2)). Requires no_new_privs, and a process with one thread. Returns false if the
// system refuses it. Does nothing on an architecture other than x86-64 and AArch64.
bool protect_other_processes();

}  // namespace linegate::gateway
