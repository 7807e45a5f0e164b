// SPDX-License-Identifier: Apache-2.0
// Which file a path names: a file that was removed or replaced has another identity.
#pragma once

#include <cstdint>
#include <string>

#include <sys/stat.h>

namespace linegate::gateway {

struct FileIdentity {
  std::uint64_t device = 0;
  std::uint64_t inode = 0;  // 0: there is no file

  static FileIdentity of(const std::string& path) {
    struct stat found {};
    return stat(path.c_str(), &found) == 0 ? FileIdentity{found.st_dev, found.st_ino}
                                           : FileIdentity{};
  }
  // The file that a descriptor has open.
  static FileIdentity of(int descriptor) {
    struct stat found {};
    return fstat(descriptor, &found) == 0 ? FileIdentity{found.st_dev, found.st_ino}
                                          : FileIdentity{};
  }

  friend bool operator==(const FileIdentity&, const FileIdentity&) = default;
};

}  // namespace linegate::gateway
