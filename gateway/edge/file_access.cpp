// SPDX-License-Identifier: Apache-2.0
#include "gateway/edge/file_access.h"

#include <fcntl.h>
#include <linux/landlock.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace linegate::gateway {
namespace {

// Headers of Linux 6.1 lack this one (ABI 3, Linux 6.2).
constexpr std::uint64_t kTruncate = std::uint64_t{1} << 14U;

constexpr std::uint64_t kInFolders =
    LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_MAKE_REG | LANDLOCK_ACCESS_FS_REMOVE_FILE;
constexpr std::uint64_t kHandled = kInFolders | LANDLOCK_ACCESS_FS_REMOVE_DIR |
                                   LANDLOCK_ACCESS_FS_MAKE_CHAR | LANDLOCK_ACCESS_FS_MAKE_DIR |
                                   LANDLOCK_ACCESS_FS_MAKE_SOCK | LANDLOCK_ACCESS_FS_MAKE_FIFO |
                                   LANDLOCK_ACCESS_FS_MAKE_BLOCK | LANDLOCK_ACCESS_FS_MAKE_SYM;

bool permit(int rules, const char* folder, std::uint64_t access) {
  const int descriptor = open(folder, O_PATH | O_CLOEXEC | O_DIRECTORY);
  if (descriptor < 0) {
    return true;
  }
  const landlock_path_beneath_attr attribute{.allowed_access = access, .parent_fd = descriptor};
  const long result =
      syscall(SYS_landlock_add_rule, rules, LANDLOCK_RULE_PATH_BENEATH, &attribute, 0);
  close(descriptor);
  return result == 0;
}

}  // namespace

WriteLimit restrict_writing(const std::vector<const char*>& folders) {
  const long abi =
      syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  if (abi < 1) {
    return WriteLimit::unavailable;
  }
  const std::uint64_t truncate = abi >= 3 ? kTruncate : 0;
  // With ABI 1, renaming between folders is always refused.
  const std::uint64_t rename = abi >= 2 ? LANDLOCK_ACCESS_FS_REFER : 0;
  landlock_ruleset_attr attribute{};
  attribute.handled_access_fs = kHandled | truncate | rename;
  const int rules = static_cast<int>(
      syscall(SYS_landlock_create_ruleset, &attribute, sizeof(attribute.handled_access_fs), 0));
  if (rules < 0) {
    return WriteLimit::refused;
  }
  bool good = true;
  for (const char* folder : folders) {
    good = good && permit(rules, folder, kInFolders | truncate);
  }
  good = good && syscall(SYS_landlock_restrict_self, rules, 0) == 0;
  close(rules);
  return good ? WriteLimit::set : WriteLimit::refused;
}

}  // namespace linegate::gateway
