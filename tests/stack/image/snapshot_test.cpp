// SPDX-License-Identifier: Apache-2.0
// Snapshots: stale blocks, changed and valid bits, PDO marks, and the merging of unread ones.
#include "stack/image/snapshot.h"

#include <random>

#include <gtest/gtest.h>

#include "stack/image/process_image.h"

#include "tests/stack/image/layouts.h"

namespace linegate::image {
namespace {

using test::kIn;
using test::make_layout;
using test::no_outputs;

Instant at(int ms) {
  return Instant(std::chrono::milliseconds(ms));
}

// Two PDOs: entries 0, 1 (16 bit) and entry 2 (32 bit).
ProcessImage& small() {
  static std::unique_ptr<ProcessImage> image;
  image = std::make_unique<ProcessImage>(
      make_layout(kIn, 8, {{1, 0, 16}, {1, 16, 16}, {2, 32, 32, 6}}), no_outputs());
  return *image;
}

void receive(ProcessImage& image, std::uint16_t pdo, std::uint32_t offset, std::uint64_t value,
             std::uint64_t mask, Instant time) {
  image.area(kIn).merge(offset, value, mask);
  image.area(kIn).touch(pdo - 1U, time);
}

TEST(Snapshot, SaysWhatItIs) {
  ProcessImage& image = small();
  Snapshot snapshot;
  image.snapshot(kIn, snapshot, at(7), false, 42);
  EXPECT_EQ(snapshot.layout_id, image.layout(kIn).id);
  EXPECT_EQ(snapshot.direction, kIn);
  EXPECT_EQ(snapshot.sequence, 1U);
  EXPECT_EQ(snapshot.acquired, at(7));
  EXPECT_EQ(snapshot.sync_count, 42U);
  EXPECT_EQ(snapshot.bytes.size(), 8U);
  EXPECT_TRUE(snapshot.marks.empty());
  image.snapshot(kIn, snapshot, at(8), false, 43);
  EXPECT_EQ(snapshot.sequence, 2U);
}

TEST(Snapshot, HasBytesChangedBitsAndMarks) {
  ProcessImage& image = small();
  receive(image, 1, 0, 0x0000'1234, 0xFFFF'FFFF, at(1));
  receive(image, 1, 0, 0x0000'5678, 0xFFFF'FFFF, at(2));
  EXPECT_TRUE(image.changed(kIn));
  EXPECT_TRUE(image.touched(kIn));
  Snapshot snapshot;
  image.snapshot(kIn, snapshot, at(3), false, 0);
  EXPECT_FALSE(image.changed(kIn));
  EXPECT_FALSE(image.touched(kIn));
  EXPECT_EQ(snapshot.bytes[0], std::byte{0x78});
  EXPECT_EQ(snapshot.bytes[1], std::byte{0x56});
  EXPECT_TRUE(snapshot.is_changed(0));
  EXPECT_FALSE(snapshot.is_changed(1));
  EXPECT_FALSE(snapshot.is_changed(2));
  ASSERT_EQ(snapshot.marks.size(), 1U);
  const PdoMark& mark = snapshot.marks[0];
  EXPECT_EQ(mark.local_pdo, 1);
  EXPECT_EQ(mark.remote_pdo, 101);
  EXPECT_EQ(mark.node, 5);
  EXPECT_EQ(mark.count, 2U);
  EXPECT_EQ(mark.time, at(2));
  EXPECT_EQ(mark.first_entry, 0U);
  EXPECT_EQ(mark.entries, 2U);
}

TEST(Snapshot, AFrameWithTheSameValuesIsAMarkButNoChange) {
  ProcessImage& image = small();
  receive(image, 2, 4, 0, 0xFFFF'FFFF, at(1));
  EXPECT_FALSE(image.changed(kIn));
  EXPECT_TRUE(image.touched(kIn));
  Snapshot snapshot;
  image.snapshot(kIn, snapshot, at(3), false, 0);
  EXPECT_EQ(snapshot.changed[0], 0U);
  ASSERT_EQ(snapshot.marks.size(), 1U);
  EXPECT_EQ(snapshot.marks[0].local_pdo, 2);
}

TEST(Snapshot, AValueThatWentBackHasChanged) {
  ProcessImage& image = small();
  receive(image, 1, 0, 1, 0xFFFF, at(1));
  receive(image, 1, 0, 0, 0xFFFF, at(2));
  Snapshot snapshot;
  image.snapshot(kIn, snapshot, at(3), false, 0);
  EXPECT_TRUE(snapshot.is_changed(0));
}

TEST(Snapshot, MarksAreThoseSinceTheLast) {
  ProcessImage& image = small();
  Snapshot snapshot;
  receive(image, 1, 0, 1, 0xFFFF, at(1));
  image.snapshot(kIn, snapshot, at(2), false, 0);
  receive(image, 2, 4, 9, 0xFFFF'FFFF, at(3));
  image.snapshot(kIn, snapshot, at(4), false, 0);
  EXPECT_FALSE(snapshot.is_changed(0));
  EXPECT_TRUE(snapshot.is_changed(2));
  ASSERT_EQ(snapshot.marks.size(), 1U);
  EXPECT_EQ(snapshot.marks[0].local_pdo, 2);
  EXPECT_EQ(snapshot.bytes[0], std::byte{1});
}

TEST(Snapshot, AnUnreadOneIsMergedIntoTheNext) {
  ProcessImage& image = small();
  Snapshot snapshot;
  receive(image, 1, 0, 1, 0xFFFF, at(1));
  receive(image, 2, 4, 1, 0xFFFF'FFFF, at(2));
  image.snapshot(kIn, snapshot, at(3), false, 0);
  receive(image, 1, 2, 1, 0xFFFF, at(4));
  image.snapshot(kIn, snapshot, at(5), true, 0);
  EXPECT_TRUE(snapshot.is_changed(0));
  EXPECT_TRUE(snapshot.is_changed(1));
  EXPECT_TRUE(snapshot.is_changed(2));
  ASSERT_EQ(snapshot.marks.size(), 2U);
  EXPECT_EQ(snapshot.marks[0].local_pdo, 1);
  EXPECT_EQ(snapshot.marks[0].count, 2U);
  EXPECT_EQ(snapshot.marks[0].time, at(4));
  EXPECT_EQ(snapshot.marks[1].local_pdo, 2);
  EXPECT_EQ(snapshot.marks[1].count, 1U);
  EXPECT_EQ(snapshot.marks[1].time, at(2));
  image.snapshot(kIn, snapshot, at(6), false, 0);
  EXPECT_TRUE(snapshot.marks.empty());
  EXPECT_EQ(snapshot.changed[0], 0U);
}

TEST(Snapshot, ValidityIsThatOfNow) {
  ProcessImage& image = small();
  Snapshot snapshot;
  image.set_pdo_valid(kIn, 1, true);
  EXPECT_TRUE(image.changed(kIn));
  image.snapshot(kIn, snapshot, at(1), false, 0);
  EXPECT_TRUE(snapshot.is_valid(0));
  EXPECT_TRUE(snapshot.is_valid(1));
  EXPECT_FALSE(snapshot.is_valid(2));
  EXPECT_EQ(snapshot.changed[0], 0U);
  image.set_node_valid(5, false);
  image.snapshot(kIn, snapshot, at(2), true, 0);
  EXPECT_FALSE(snapshot.is_valid(0));
}

TEST(Snapshot, OfAnotherLayoutIsMadeAnew) {
  ProcessImage& image = small();
  Snapshot snapshot;
  snapshot.layout_id = 99;
  snapshot.bytes.resize(3);
  snapshot.marks.push_back({.local_pdo = 60'000, .count = 5});
  receive(image, 1, 0, 1, 0xFFFF, at(1));
  image.snapshot(kIn, snapshot, at(2), true, 0);
  EXPECT_EQ(snapshot.layout_id, image.layout(kIn).id);
  EXPECT_EQ(snapshot.bytes.size(), 8U);
  ASSERT_EQ(snapshot.marks.size(), 1U);
  EXPECT_EQ(snapshot.marks[0].local_pdo, 1);
}

// Three copies are updated in random order, as in a hand-over with three slots; values of all
// lengths cross the borders of the blocks.
TEST(Snapshot, EveryCopyIsUpToDateHoweverOldItIs) {
  std::vector<test::EntryAt> entries;
  std::uint32_t bit = 0;
  std::mt19937 random(1);
  for (std::uint16_t pdo = 1; bit + 64 < 8U * 500; ++pdo) {
    const auto bits = static_cast<std::uint16_t>(1 + random() % 64);
    entries.push_back({pdo, bit, bits});
    bit += bits;
  }
  ProcessImage image(make_layout(kIn, 500, entries), no_outputs());
  std::array<Snapshot, 3> copies;
  std::vector<std::uint64_t> last(entries.size());
  for (int round = 0; round < 500; ++round) {
    std::vector<bool> changed(entries.size());
    for (int writes = 0; writes < 5; ++writes) {
      const auto entry = static_cast<std::uint32_t>(random() % entries.size());
      const std::uint64_t value = random() % 3;
      changed[entry] = image.write_entry(kIn, entry, value) || changed[entry];
    }
    Snapshot& copy = copies[random() % copies.size()];
    image.snapshot(kIn, copy, at(round), false, 0);
    ASSERT_TRUE(std::ranges::equal(copy.bytes, image.bytes(kIn))) << "round " << round;
    for (std::size_t i = 0; i < entries.size(); ++i) {
      ASSERT_EQ(copy.is_changed(i), changed[i]) << "round " << round << " entry " << i;
    }
  }
}

}  // namespace
}  // namespace linegate::image
