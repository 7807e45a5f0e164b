// SPDX-License-Identifier: Apache-2.0
// The open file descriptors of this process: Fast DDS gives no access to its sockets.
#pragma once

#include <charconv>
#include <string_view>

#include <dirent.h>

namespace linegate::dds::guard {

// Calls each(int descriptor) for every descriptor that is open now.
template <class Each>
void each_descriptor(Each each) {
  DIR* const folder = ::opendir("/proc/self/fd");
  if (folder == nullptr)
    return;
  while (const dirent* entry = ::readdir(folder)) {
    const std::string_view name(entry->d_name);
    int descriptor = -1;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), descriptor);
    if (error == std::errc())
      each(descriptor);
  }
  ::closedir(folder);
}

}  // namespace linegate::dds::guard
