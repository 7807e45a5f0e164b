// SPDX-License-Identifier: Apache-2.0
#include "gateway/exchange/shared_slots.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <system_error>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

namespace linegate::exchange {
namespace {

constexpr SlotWriter::Sizes kSizes{100, 5'000};

// The content of that record in that series.
std::vector<std::byte> content(std::size_t series, std::uint64_t number) {
  std::vector<std::byte> out(kSizes.at(series) - number % 50);
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = static_cast<std::byte>((number * 31 + i + series) & 0xFFU);
  }
  return out;
}

// Returns its number; 0: no room.
std::uint64_t write(SlotWriter& writer, std::size_t series, std::uint64_t number) {
  const auto draft = writer.draft(series);
  if (draft.empty()) {
    return 0;
  }
  const auto record = content(series, number);
  std::ranges::copy(record, draft.begin());
  return writer.publish(series, record.size());
}

bool is_right(std::size_t series, const SlotReader::Record& record) {
  return std::ranges::equal(record.data, content(series, record.number));
}

// What a hostile process can do: its own mapping of the reports.
class Reports {
 public:
  explicit Reports(const SlotWriter& writer)
      : memory_(writer.descriptors()[1], 4'096, SharedMemory::Other::writes) {}
  void set(std::size_t series, std::uint64_t done) {
    auto* const word = reinterpret_cast<std::atomic<std::uint64_t>*>(memory_.data() + series * 64);
    word->store(done, std::memory_order_release);
  }

 private:
  SharedMemory memory_;
};

TEST(SharedSlots, KeepTheOrderOfEachSeries) {
  SlotWriter writer(kSizes);
  SlotReader reader(writer.descriptors());
  EXPECT_FALSE(reader.any());
  for (std::uint64_t number = 1; number <= 100; ++number) {
    for (std::size_t series = 0; series < kSharedSeries; ++series) {
      ASSERT_EQ(write(writer, series, number), number);
      ASSERT_TRUE(reader.any());
      const auto record = reader.next(series);
      ASSERT_EQ(record.number, number);
      ASSERT_TRUE(is_right(series, record));
      reader.done(series);
      ASSERT_EQ(reader.next(series).number, 0U);
    }
  }
  EXPECT_EQ(writer.published(), 200U);
}

TEST(SharedSlots, AFullSeriesTakesNothingUntilARecordWasCarriedOut) {
  SlotWriter writer(kSizes);
  std::uint64_t number = 1;
  while (write(writer, 0, number) != 0) {
    ++number;
  }
  EXPECT_EQ(number, SlotWriter::kSlots);
  EXPECT_EQ(write(writer, 1, 1), 1U) << "each series has its own room";
  SlotReader reader(writer.descriptors());
  EXPECT_TRUE(is_right(0, reader.next(0)));
  EXPECT_EQ(write(writer, 0, number), 0U);
  reader.done(0);
  EXPECT_EQ(write(writer, 0, number), number);
  EXPECT_EQ(write(writer, 0, number + 1), 0U);
}

// A process may end between carrying out a record and reporting it, or at any other time.
TEST(SharedSlots, AReaderThatTakesOverBeginsWithTheLastRecordCarriedOut) {
  const auto seed = std::random_device()();
  std::mt19937 random(seed);
  SlotWriter writer(kSizes);
  std::vector<std::uint64_t> read;
  std::uint64_t written = 0;
  std::optional<SlotReader> reader;
  for (int round = 0; round < 2'000; ++round) {
    if (!reader || random() % 10 == 0) {
      reader.emplace(writer.descriptors());
    }
    for (auto count = random() % 10; count > 0; --count) {
      written = std::max(written, write(writer, 1, written + 1));
    }
    for (auto count = random() % 10; count > 0; --count) {
      const auto record = reader->next(1);
      if (record.number == 0) {
        break;
      }
      ASSERT_TRUE(is_right(1, record)) << "seed " << seed;
      const std::uint64_t last = read.empty() ? 0 : read.back();
      ASSERT_LE(record.number, last + 1) << "seed " << seed;
      ASSERT_GE(record.number + 1, last) << "only the last one again, seed " << seed;
      read.push_back(record.number);
      if (random() % 20 == 0) {
        reader.reset();
        break;
      }
      reader->done(1);
    }
  }
  EXPECT_FALSE(writer.damaged());
  EXPECT_GT(read.back(), 100U);
}

TEST(SharedSlots, TheOtherProcessCannotWriteToRecordsOrTruncateThem) {
  SlotWriter writer(kSizes);
  ASSERT_EQ(write(writer, 0, 1), 1U);
  const int records = writer.descriptors()[0];
  const auto size = static_cast<std::size_t>(lseek(records, 0, SEEK_END));
  EXPECT_EQ(mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, records, 0), MAP_FAILED);
  void* const readable = mmap(nullptr, size, PROT_READ, MAP_SHARED, records, 0);
  ASSERT_NE(readable, MAP_FAILED);
  EXPECT_NE(mprotect(readable, size, PROT_READ | PROT_WRITE), 0);
  munmap(readable, size);
  EXPECT_LT(pwrite(records, "x", 1, 0), 0);
  EXPECT_NE(ftruncate(records, 1), 0);
  EXPECT_NE(ftruncate(writer.descriptors()[1], 1), 0);
}

TEST(SharedSlots, RefuseOtherDescriptors) {
  const SlotWriter writer(kSizes);
  const auto [records, reports] = writer.descriptors();
  EXPECT_THROW(SlotReader({reports, records}), std::system_error);
  EXPECT_THROW(SlotReader({records, STDIN_FILENO}), std::system_error);
}

// Whatever it reports, the writer continues with its own numbers and overwrites no record that was
// not reported, and a reader that takes over loses none.
TEST(SharedSlots, AnImpossibleReportIsDamageAndNothingElse) {
  for (const std::uint64_t garbage :
       {std::uint64_t{1}, std::uint64_t{20}, std::uint64_t{1'000}, std::uint64_t{1} << 63U,
        std::numeric_limits<std::uint64_t>::max()}) {
    SlotWriter writer(kSizes);
    Reports reports(writer);
    ASSERT_EQ(write(writer, 0, 1), 1U);
    ASSERT_EQ(write(writer, 0, 2), 2U);
    reports.set(0, 2);
    for (std::uint64_t number = 3; number <= 5; ++number) {
      ASSERT_EQ(write(writer, 0, number), number);
    }
    EXPECT_FALSE(writer.damaged());
    reports.set(0, garbage);  // before the last report, or after the last record
    ASSERT_EQ(write(writer, 0, 6), 6U);
    EXPECT_TRUE(writer.damaged());
    for (std::uint64_t number = 7; number <= 9; ++number) {
      ASSERT_EQ(write(writer, 0, number), number);
    }
    EXPECT_EQ(write(writer, 0, 10), 0U) << "2 and all after it are kept";
    writer.forget_damage();
    EXPECT_FALSE(writer.damaged());
    SlotReader reader(writer.descriptors());
    for (std::uint64_t number = 2; number <= 9; ++number) {
      ASSERT_EQ(reader.next(0).number, number);
      ASSERT_TRUE(is_right(0, reader.next(0)));
      reader.done(0);
    }
    EXPECT_EQ(write(writer, 0, 10), 10U);
    EXPECT_FALSE(writer.damaged());
  }
}

TEST(SharedSlots, AnyReportsLeaveTheNumbersAndTheMemoryInOrder) {
  const auto seed = std::random_device()();
  std::mt19937_64 random(seed);
  SlotWriter writer(kSizes);
  Reports reports(writer);
  std::uint64_t expected = 0;
  for (int round = 0; round < 20'000; ++round) {
    reports.set(0, random() % 3 == 0 ? random() : expected - random() % 12);
    if (const auto number = write(writer, 0, expected + 1); number != 0) {
      ASSERT_EQ(number, ++expected) << "seed " << seed;
    }
    if (random() % 100 == 0) {
      writer.forget_damage();
      SlotReader reader(writer.descriptors());
      const auto record = reader.next(0);
      ASSERT_TRUE(record.number == 0 || is_right(0, record)) << "seed " << seed;
    }
  }
}

TEST(SharedSlots, TwoThreadsSeeEveryRecordInOrder) {
  constexpr std::uint64_t kRecords = 20'000;
  SlotWriter writer(kSizes);
  std::thread other([&] {
    SlotReader reader(writer.descriptors());
    for (std::uint64_t number = 1; number <= kRecords;) {
      const auto record = reader.next(0);
      if (record.number == 0) {
        std::this_thread::yield();
        continue;
      }
      ASSERT_EQ(record.number, number++);
      ASSERT_TRUE(is_right(0, record));
      reader.done(0);
    }
  });
  for (std::uint64_t number = 1; number <= kRecords;) {
    if (write(writer, 0, number) != 0) {
      ++number;
    } else {
      std::this_thread::yield();
    }
  }
  other.join();
  EXPECT_FALSE(writer.damaged());
}

}  // namespace
}  // namespace linegate::exchange
