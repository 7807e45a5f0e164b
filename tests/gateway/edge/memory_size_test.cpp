// SPDX-License-Identifier: Apache-2.0
#include "gateway/edge/memory_size.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

namespace linegate::gateway {
namespace {

TEST(MemorySize, LeavesOutWhatIsShared) {
  const std::string file = testing::TempDir() + "statm_" + std::to_string(getpid());
  std::ofstream(file) << "900 100 30 5 0 400 0\n";
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const MemorySize size = memory_size(file.c_str());
  EXPECT_EQ(size.resident, 70 * page);
  EXPECT_EQ(size.data, 400 * page);
  std::filesystem::remove(file);
  EXPECT_EQ(memory_size(file.c_str()).resident, 0U);
}

TEST(MemorySize, OfThisProcessGrowsWithWhatIsWritten) {
  constexpr std::size_t kBytes = 40'000'000;
  const MemorySize before = memory_size("/proc/self/statm");
  void* const memory =
      mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(memory, MAP_FAILED);
  const MemorySize reserved = memory_size("/proc/self/statm");
  EXPECT_GE(reserved.data, before.data + kBytes);
  EXPECT_LT(reserved.resident, before.resident + kBytes / 2);
  std::memset(memory, 1, kBytes);
  EXPECT_GE(memory_size("/proc/self/statm").resident, reserved.resident + kBytes / 2);
  munmap(memory, kBytes);
}

}  // namespace
}  // namespace linegate::gateway
