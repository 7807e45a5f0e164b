// SPDX-License-Identifier: Apache-2.0
// The sequence number of each instance's newest sample never lags behind the writer's last one by
// more than the permitted distance, whatever other instances do.
#include "bridges/dds/held_samples.h"

#include <map>
#include <string>

#include <gtest/gtest.h>

namespace linegate::dds {
namespace {

using Held = HeldSamples<int, std::string>;

// A writer that uses HeldSamples, and the distance of the newest sample of each instance from the
// last number written.
struct Writer {
  void write(int instance, const std::string& sample) {
    EXPECT_EQ(held.note(instance, sample), sample);
    last[instance] = ++written;
    while (const std::string* stale = held.pop_stale()) {
      ++repeated;
      last[std::stoi(*stale)] = ++written;
    }
  }
  std::uint64_t span() const {
    std::uint64_t oldest = written;
    for (const auto& [instance, number] : last)
      oldest = std::min(oldest, number);
    return written - oldest;
  }

  Held held;
  std::map<int, std::uint64_t> last;
  std::uint64_t written = 0;
  std::uint64_t repeated = 0;
};

TEST(HeldSamples, ASilentInstanceIsWrittenAgain) {
  Writer writer;
  writer.write(1, "1 first");
  for (int i = 0; i < 100'000; ++i) {
    writer.write(2, "2");
    ASSERT_LE(writer.span(), Held::kMostSince);
  }
  EXPECT_EQ(writer.repeated, 100'000 / Held::kMostSince);
}

TEST(HeldSamples, NothingIsWrittenAgainWhileAllSpeak) {
  Writer writer;
  for (int i = 0; i < 100'000; ++i)
    writer.write(i % 500, std::to_string(i % 500));
  EXPECT_EQ(writer.repeated, 0U);
}

TEST(HeldSamples, TheNewestSampleIsTheOneWrittenAgain) {
  Held held;
  held.note(1, "old");
  held.note(1, "new");
  held.note(2, "");
  std::string* stale = nullptr;
  while ((stale = held.pop_stale()) == nullptr)
    held.note(2, "");
  EXPECT_EQ(*stale, "new");
}

TEST(HeldSamples, ManySilentInstancesDoNotDriveEachOtherWithoutEnd) {
  constexpr int kInstances = 8'128;
  Writer writer;
  for (int i = 0; i < kInstances; ++i)
    writer.write(i, std::to_string(i));
  for (int i = 0; i < 50'000; ++i) {
    writer.write(0, "0");
    if (i % 500 == 0) {
      ASSERT_LE(writer.span(), 2U * kInstances);
    }
  }
  // In each cycle through all instances, new samples are at least as many as repeated ones.
  EXPECT_LE(writer.repeated, 50'000U);
}

TEST(HeldSamples, WhatIsDroppedIsNotWrittenAgain) {
  Held held;
  held.note(1, "goes");
  held.note(2, "stays");
  std::string dropped;
  held.drop([](const std::string& sample) { return sample == "goes"; },
            [&](int instance, const std::string&) { dropped += std::to_string(instance); });
  EXPECT_EQ(dropped, "1");
  for (int i = 0; i < 5'000; ++i) {
    held.note(3, "speaks");
    while (const std::string* stale = held.pop_stale()) {
      ASSERT_EQ(*stale, "stays");
    }
  }
}

TEST(HeldSamples, NothingIsHeldAtFirst) {
  Held held;
  EXPECT_EQ(held.pop_stale(), nullptr);
}

}  // namespace
}  // namespace linegate::dds
