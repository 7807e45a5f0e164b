// SPDX-License-Identifier: Apache-2.0
// A process that is killed at any system call, or loses power at any moment, leaves a file with the
// old contents or with the new contents, never a mix and never nothing.
#include "gateway/runtime/parameter_file.h"

#include <cerrno>
#include <csignal>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include "gateway/runtime/storage_thread.h"
#include "stack/storage/image.h"

namespace linegate::gateway {
namespace {

using Bytes = std::vector<std::byte>;

// At least 600 bytes, so that a mix of two contents would be noticed.
Bytes contents(unsigned number) {
  const storage::StoredValue value{{0x2000, 0}, Bytes(600 + number % 64, std::byte(number))};
  return storage::encode({5, {1, 2, 3}}, std::span(&value, 1));
}

// A simulated disk. A power cut loses none, all or a part of the data that fsync has not written.
// Names and contents are written separately, as on a real disk.
class Disk {
 public:
  struct File {
    Bytes now;
    Bytes forced;
  };
  using Names = std::map<std::string, std::shared_ptr<File>>;

  enum class Lost { nothing, contents, half_of_contents, names, both };

  void cut_power(Lost lost) {
    if (lost == Lost::names || lost == Lost::both) {
      names = forced_names;
    }
    for (auto& [name, file] : names) {
      if (lost == Lost::contents || lost == Lost::both) {
        file->now = file->forced;
      } else if (lost == Lost::half_of_contents && file->now != file->forced) {
        file->now.resize(file->now.size() / 2);
      }
    }
  }

  Names names;
  Names forced_names;
};

// File calls on the disk. From call number `last` on, calls fail without any effect.
class DiskCalls final : public FileCalls {
 public:
  DiskCalls(Disk& disk, unsigned last) : disk_(disk), left_(last) {}
  bool stopped() const { return stopped_; }

  int create(const std::string& path) override {
    if (!next()) {
      return -1;
    }
    auto& file = disk_.names[path];
    if (file == nullptr) {
      file = std::make_shared<Disk::File>();
    }
    file->now.clear();
    open_ = file;
    return 3;
  }
  int open_folder(const std::string& /*path*/) override {
    open_.reset();
    return next() ? 4 : -1;
  }
  // Writes at most 100 bytes in each call.
  std::ptrdiff_t write(int /*descriptor*/, std::span<const std::byte> bytes) override {
    if (!next()) {
      return -1;
    }
    const auto part = bytes.first(std::min<std::size_t>(bytes.size(), 100));
    open_->now.insert(open_->now.end(), part.begin(), part.end());
    return static_cast<std::ptrdiff_t>(part.size());
  }
  int sync(int descriptor) override {
    if (!next()) {
      return -1;
    }
    if (descriptor == 4) {
      disk_.forced_names = disk_.names;
    } else {
      open_->forced = open_->now;
    }
    return 0;
  }
  int close(int /*descriptor*/) override { return next() ? 0 : -1; }
  int rename(const std::string& from, const std::string& to) override {
    if (!next()) {
      return -1;
    }
    disk_.names[to] = disk_.names.at(from);
    disk_.names.erase(from);
    return 0;
  }
  int remove(const std::string& path) override {
    if (!next()) {
      return -1;
    }
    disk_.names.erase(path);
    return 0;
  }
  int read(const std::string& path, Bytes& bytes) override {
    const auto found = disk_.names.find(path);
    if (found == disk_.names.end()) {
      return ENOENT;
    }
    bytes = found->second->now;
    return 0;
  }

 private:
  bool next() {
    stopped_ = stopped_ || left_ == 0;
    left_ -= stopped_ ? 0U : 1U;
    errno = EIO;
    return !stopped_;
  }

  Disk& disk_;
  unsigned left_;
  bool stopped_ = false;
  std::shared_ptr<Disk::File> open_;
};

constexpr unsigned kAllCalls = 1000;

// Checks the file after keep(second) failed at call n and the power was cut. first: the old
// contents; empty: there is no file. Returns true if keep() needs at most n calls.
bool cut_at(unsigned n, const Bytes& first, const Bytes& second, Disk::Lost lost) {
  Disk disk;
  DiskCalls before(disk, kAllCalls);
  if (!first.empty()) {
    EXPECT_TRUE(ParameterFile("folder/file", before).keep(first));
  }
  DiskCalls calls(disk, n);
  const bool kept = ParameterFile("folder/file", calls).keep(second);
  EXPECT_EQ(kept, !calls.stopped());
  disk.cut_power(lost);

  DiskCalls after(disk, kAllCalls);
  ParameterFile file("folder/file", after);
  Bytes found;
  EXPECT_TRUE(file.read(found)) << "call " << n;
  EXPECT_TRUE(found == second || (!kept && found == first))
      << "call " << n << ": " << found.size() << " bytes";
  // Remains of the failed attempt do not prevent the next one.
  EXPECT_TRUE(file.keep(contents(77)));
  EXPECT_TRUE(file.read(found));
  EXPECT_EQ(found, contents(77));
  return !calls.stopped();
}

TEST(ParameterFile, HasTheOldOrTheNewWhereverPowerFails) {
  for (const auto lost : {Disk::Lost::nothing, Disk::Lost::contents, Disk::Lost::half_of_contents,
                          Disk::Lost::names, Disk::Lost::both}) {
    for (const Bytes& first : {Bytes{}, contents(1)}) {
      unsigned n = 0;
      while (!cut_at(n, first, contents(2), lost)) {
        ++n;
      }
      EXPECT_GE(n, 14U) << "create, 7 writes, fsync, close, rename, open, fsync, close";
    }
  }
}

// --- the real calls, in a folder of this test ----------------------------------------------------

class ParameterFolder : public ::testing::Test {
 protected:
  ParameterFolder() {
    std::string name = ::testing::TempDir() + "parameters-XXXXXX";
    folder = mkdtemp(name.data());
    path = parameter_path(folder, "press", 5);
  }
  ~ParameterFolder() override { std::filesystem::remove_all(folder); }

  std::optional<Bytes> read() {
    Bytes out;
    return ParameterFile(path).read(out) ? std::optional(out) : std::nullopt;
  }

  std::string folder;
  std::string path;
};

// Kills its own process at the n-th call. A write() writes half of its bytes before.
class DeadlyCalls final : public FileCalls {
 public:
  explicit DeadlyCalls(unsigned n) : left_(n) {}

  int create(const std::string& p) override { return due() ? die() : FileCalls::create(p); }
  int open_folder(const std::string& p) override {
    return due() ? die() : FileCalls::open_folder(p);
  }
  std::ptrdiff_t write(int descriptor, std::span<const std::byte> bytes) override {
    const bool last = due();
    const std::size_t part = last ? bytes.size() / 2 : std::min<std::size_t>(bytes.size(), 100);
    const std::ptrdiff_t done = FileCalls::write(descriptor, bytes.first(part));
    return last ? die() : done;
  }
  int sync(int descriptor) override { return due() ? die() : FileCalls::sync(descriptor); }
  int close(int descriptor) override { return due() ? die() : FileCalls::close(descriptor); }
  int rename(const std::string& from, const std::string& to) override {
    return due() ? die() : FileCalls::rename(from, to);
  }

 private:
  bool due() { return left_-- == 0; }
  static int die() {
    kill(getpid(), SIGKILL);
    return -1;
  }

  unsigned left_;
};

TEST_F(ParameterFolder, AProcessKilledAtEveryCallLeavesTheOldOrTheNew) {
  for (unsigned n = 0;; ++n) {
    ASSERT_TRUE(ParameterFile(path).keep(contents(1)));
    const pid_t child = fork();
    if (child == 0) {
      DeadlyCalls calls(n);
      _exit(ParameterFile(path, calls).keep(contents(2)) ? 0 : 1);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    const auto found = read();
    ASSERT_TRUE(found.has_value()) << "call " << n;
    if (WIFEXITED(status)) {
      EXPECT_EQ(WEXITSTATUS(status), 0);
      EXPECT_EQ(*found, contents(2));
      EXPECT_EQ(n, 14U);
      return;
    }
    EXPECT_TRUE(*found == contents(1) || *found == contents(2)) << "call " << n;
  }
}

// The child process stores one image after the other, reports each stored image over a pipe, and is
// killed at a random moment.
TEST_F(ParameterFolder, AProcessKilledAtAnyMomentLeavesWhatItHadKeptOrTheNext) {
  std::minstd_rand random(3);
  unsigned kept = 0;
  ASSERT_TRUE(ParameterFile(path).keep(contents(kept)));
  for (int round = 0; round < 25; ++round) {
    int pipes[2] = {-1, -1};
    ASSERT_EQ(pipe(pipes), 0);
    const pid_t child = fork();
    if (child == 0) {
      for (unsigned number = kept + 1;; ++number) {
        const bool good = ParameterFile(path).keep(contents(number));
        if (!good || write(pipes[1], "k", 1) != 1) {
          _exit(1);
        }
      }
    }
    close(pipes[1]);
    char done = 0;
    for (auto wanted = random() % 8; wanted > 0; --wanted) {
      ASSERT_EQ(::read(pipes[0], &done, 1), 1);
      ++kept;
    }
    for (auto spin = random() % 100'000; spin > 0; --spin) {
      asm volatile("");
    }
    kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFSIGNALED(status));
    while (::read(pipes[0], &done, 1) == 1) {
      ++kept;
    }
    close(pipes[0]);
    const auto found = read();
    ASSERT_TRUE(found.has_value());
    if (*found == contents(kept + 1)) {
      ++kept;  // killed between storing and reporting
    }
    EXPECT_EQ(*found, contents(kept)) << "round " << round;
  }
}

TEST_F(ParameterFolder, AFileThatIsNotThereIsNothingStored) {
  EXPECT_EQ(read(), Bytes{});
}

TEST_F(ParameterFolder, AnEmptyFileIsOneThatLostItsContents) {
  std::filesystem::create_directories(folder);
  ASSERT_TRUE(FileCalls::system().create(path) >= 0);
  EXPECT_EQ(read(), std::nullopt);
}

TEST_F(ParameterFolder, AFailureLeavesWhatWasThere) {
  ASSERT_TRUE(ParameterFile(path).keep(contents(1)));
  ASSERT_TRUE(std::filesystem::create_directory(path + ".new"))
      << "this folder blocks the new file";
  EXPECT_FALSE(ParameterFile(path).keep(contents(2)));
  EXPECT_EQ(read(), contents(1));
  EXPECT_FALSE(ParameterFile(folder + "/nowhere/file").keep(contents(2)));
}

TEST_F(ParameterFolder, NamesOfFilesAndFolders) {
  EXPECT_EQ(parameter_path("a/b", "press", 127), "a/b/press-127.parameters");
  EXPECT_EQ(parameter_path("a", "", 5), "a/node-5.parameters");
  EXPECT_EQ(lss_path("a/b", "press", 5), "a/b/press-5.lss");
  EXPECT_FALSE(make_parameter_folder("").has_value());
  EXPECT_FALSE(make_parameter_folder(folder + "/new/er").has_value());
  EXPECT_TRUE(std::filesystem::is_directory(folder + "/new/er"));
  ASSERT_TRUE(ParameterFile(path).keep(contents(1)));
  const auto problem = make_parameter_folder(path);
  ASSERT_TRUE(problem.has_value());
  EXPECT_EQ(problem->severity, Severity::error);
}

// --- the thread that waits for the disk ----------------------------------------------------------

// Waits until the storage thread has woken the line.
bool result_of(StoredParameters& file, exchange::Wakeup& line) {
  for (;;) {
    line.clear();
    if (const auto result = file.pop_result()) {
      return *result;
    }
    pollfd waiting{line.descriptor(), POLLIN, 0};
    poll(&waiting, 1, -1);
  }
}

TEST_F(ParameterFolder, TheKeeperTellsWhenAFileHasIt) {
  exchange::Wakeup line;
  StorageThread thread;
  StoredParameters& file = thread.add(path, line);
  StoredParameters& nowhere = thread.add(folder + "/nowhere/file", line);
  EXPECT_TRUE(file.slow());
  EXPECT_TRUE(file.keep(contents(1)));
  EXPECT_FALSE(file.keep(contents(2))) << "one value at a time";
  EXPECT_EQ(file.pop_result(), std::nullopt);
  thread.start();
  EXPECT_TRUE(result_of(file, line));
  EXPECT_EQ(read(), contents(1));
  EXPECT_TRUE(nowhere.keep(contents(3)));
  EXPECT_FALSE(result_of(nowhere, line));
  EXPECT_TRUE(file.keep(contents(2)));
  thread.stop();
  EXPECT_EQ(read(), contents(2)) << "values given before the end are stored";
  EXPECT_EQ(file.pop_result(), true);
}

}  // namespace
}  // namespace linegate::gateway
