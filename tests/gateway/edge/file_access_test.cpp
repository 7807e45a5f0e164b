// SPDX-License-Identifier: Apache-2.0
#include "gateway/edge/file_access.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <sys/xattr.h>
#include <unistd.h>

#include "gateway/edge/system_calls.h"

namespace linegate::gateway {
namespace {

bool prevented(long result) {
  return result == -1 && (errno == EACCES || errno == EPERM || errno == EXDEV);
}

// Two folders: the process may write in `open` only. Each has a file of 4 octets.
class FileAccess : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = std::filesystem::temp_directory_path() / "file_access_XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    root_ = pattern;
    for (const char* folder : {"open", "closed"}) {
      std::filesystem::create_directory(root_ + "/" + folder);
      std::ofstream(root_ + "/" + folder + "/file") << "text";
    }
  }
  void TearDown() override { std::filesystem::remove_all(root_); }

  // Returns the exit code of the function in a child of this process with both limits.
  template <class Function>
  int in_child(Function function) {
    const std::string open_folder = root_ + "/open";
    const pid_t child = fork();
    if (child == 0) {
      const bool ready = prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && protect_other_processes();
      const WriteLimit limit = restrict_writing({open_folder.c_str(), "/nonexistent"});
      _exit(ready && limit == WriteLimit::set ? function() : 100 + static_cast<int>(limit));
    }
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 200 + WTERMSIG(status);
  }

  // Returns the number of the first attempt that was not refused, 0 if there is none.
  int attack() const {
    const std::string file = root_ + "/closed/file";
    const std::string other = root_ + "/closed/other";
    const std::string moved = root_ + "/open/moved";
    const std::array attempts{
        prevented(open(file.c_str(), O_WRONLY)),
        prevented(open(file.c_str(), O_RDWR)),
        prevented(open(file.c_str(), O_RDONLY | O_TRUNC)),
        prevented(open(file.c_str(), O_ACCMODE | O_TRUNC)),
        prevented(truncate(file.c_str(), 0)),
        prevented(setxattr(file.c_str(), "system.posix_acl_access", "", 0, 0)),
        prevented(utimensat(AT_FDCWD, file.c_str(), nullptr, 0)),
        prevented(open(other.c_str(), O_WRONLY | O_CREAT, 0600)),
        prevented(unlink(file.c_str())),
        prevented(rename(file.c_str(), other.c_str())),
        prevented(rename(file.c_str(), moved.c_str())),
        prevented(link(file.c_str(), moved.c_str())),
        prevented(mkdir(other.c_str(), 0700)),
        prevented(symlink(file.c_str(), other.c_str())),
        prevented(chmod(file.c_str(), 0)),
        prevented(fchmodat(AT_FDCWD, file.c_str(), 0, 0)),
    };
    for (std::size_t i = 0; i < attempts.size(); ++i) {
      if (!attempts[i]) {
        return static_cast<int>(i) + 1;
      }
    }
    return 0;
  }

  static bool unavailable() { return syscall(SYS_landlock_create_ruleset, nullptr, 0, 1) < 1; }

  std::string root_;
};

TEST_F(FileAccess, NothingOutsideOfTheFoldersCanBeChanged) {
  if (unavailable()) {
    EXPECT_EQ(in_child([] { return 0; }), 100 + static_cast<int>(WriteLimit::unavailable));
    EXPECT_NE(kWritesNotLimited.find("no Landlock"), std::string_view::npos);
    return;
  }
  EXPECT_EQ(in_child([this] { return attack(); }), 0) << "number of the attempt";
  EXPECT_EQ(std::filesystem::file_size(root_ + "/closed/file"), 4U);
}

TEST_F(FileAccess, FilesCanBeReadAndThoseInTheFoldersWritten) {
  if (unavailable()) {
    return;  // the test above asserts that it is reported
  }
  EXPECT_EQ(in_child([this] {
              const std::string made = root_ + "/open/made";
              const int file = open(made.c_str(), O_RDWR | O_CREAT | O_EXCL, 0600);
              return file >= 0 && ftruncate(file, 8) == 0 && unlink(made.c_str()) == 0 &&
                             open((root_ + "/closed/file").c_str(), O_RDONLY) >= 0
                         ? 0
                         : 1;
            }),
            0);
}

}  // namespace
}  // namespace linegate::gateway
