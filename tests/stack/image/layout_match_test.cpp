// SPDX-License-Identifier: Apache-2.0
// Which images are read through a layout whose ID another layout had before.
#include "stack/image/layout_match.h"

#include <cstdint>
#include <optional>
#include <string>

#include <gtest/gtest.h>

namespace linegate::image {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class LayoutMatchTest : public testing::Test {
 protected:
  void layout(const std::string& name, std::uint64_t id = 5) {
    Layout fresh{.id = id, .byte_size = 2};
    fresh.entries.push_back({.bit_length = 16, .name = name});
    match.take(known_layout, fresh, now);
    known_layout = fresh;
  }
  void image(std::uint64_t number, std::uint64_t id = 5) {
    const Snapshot fresh{.layout_id = id, .sequence = number, .acquired = now};
    match.take(known_image, fresh, now);
    known_image = fresh;
  }
  bool is_certain() const { return match.is_certain(now); }
  bool is_certain_after(Duration time) {
    now += time;
    return is_certain();
  }

  Instant now{seconds(1000)};
  LayoutMatch match;
  std::optional<Layout> known_layout;
  std::optional<Snapshot> known_image;
};

TEST_F(LayoutMatchTest, TheFirstLayoutAndTheImagesAfterItBelongTogether) {
  layout("a.x");
  EXPECT_TRUE(is_certain());
  image(17);
  image(18);
  layout("a.x");
  EXPECT_TRUE(is_certain()) << "the same layout again";
}

TEST_F(LayoutMatchTest, AnImageFromBeforeOtherNamesNeverCounts) {
  layout("a.x");
  image(17);
  now += seconds(30);
  layout("b.x");
  EXPECT_FALSE(is_certain());
  EXPECT_FALSE(is_certain_after(seconds(9))) << "the line has published nothing since";
  image(1);
  EXPECT_FALSE(is_certain());
  EXPECT_TRUE(is_certain_after(LayoutMatch::kRepair));
}

// The layout came more than a second late, and no input of the line changes.
TEST_F(LayoutMatchTest, NoLineIsWithoutValuesForEver) {
  layout("a.x");
  image(17);
  now += seconds(30);
  image(1);
  now += seconds(3);
  layout("b.x");
  EXPECT_FALSE(is_certain_after(LayoutMatch::kSettled - milliseconds(1)));
  EXPECT_TRUE(is_certain_after(milliseconds(1)));
}

// They come on different topics.
TEST_F(LayoutMatchTest, AnImageOfTheFormerLineMayArriveAfterTheLayout) {
  layout("a.x");
  image(17);
  now += seconds(30);
  layout("b.x");
  now += milliseconds(5);
  image(18);
  EXPECT_FALSE(is_certain_after(seconds(9)));
  image(19);
  EXPECT_TRUE(is_certain()) << "received when all images from before have been repeated";
}

TEST_F(LayoutMatchTest, TheFirstImageOfALineMayArriveBeforeItsLayout) {
  layout("a.x");
  image(17);
  now += seconds(30);
  image(1);
  EXPECT_FALSE(is_certain()) << "the layout may be on its way";
  now += milliseconds(5);
  layout("b.x");
  EXPECT_FALSE(is_certain());
  EXPECT_TRUE(is_certain_after(LayoutMatch::kRepair)) << "although no input has changed since";
}

TEST_F(LayoutMatchTest, ALineThatRestartsWithTheSameNamesCountsAfterASecond) {
  layout("a.x");
  image(17);
  now += seconds(30);
  image(1);
  EXPECT_FALSE(is_certain_after(LayoutMatch::kRepair - milliseconds(1)));
  EXPECT_TRUE(is_certain_after(milliseconds(1)));
}

TEST_F(LayoutMatchTest, EachOfTwoRestartsIsAwaited) {
  layout("a.x");
  image(17);
  now += seconds(30);
  image(1);
  layout("b.x");
  now += milliseconds(900);
  layout("c.x");
  EXPECT_FALSE(is_certain_after(milliseconds(900)));
  image(1);
  EXPECT_FALSE(is_certain_after(milliseconds(900)));
  EXPECT_TRUE(is_certain_after(milliseconds(100)));
}

TEST_F(LayoutMatchTest, AnIdThatComesBackIsAnotherLayout) {
  layout("a.x");
  image(17);
  now += seconds(30);
  layout("a.x", 6);
  EXPECT_TRUE(is_certain());
  layout("b.x");
  EXPECT_FALSE(is_certain_after(seconds(9)));
}

TEST_F(LayoutMatchTest, AnIdWithoutAnotherLayoutIsCertain) {
  layout("a.x");
  image(17);
  layout("b.x");
  EXPECT_FALSE(is_certain());
  layout("c.x", 6);
  image(18, 6);
  EXPECT_TRUE(is_certain());
  layout("c.x", 6);
  image(1, 7);
  layout("d.x", 7);
  EXPECT_TRUE(is_certain());
  layout("b.x");
  EXPECT_TRUE(is_certain()) << "read as before";
}

TEST_F(LayoutMatchTest, AnImageWithAnotherIdBeginsASeriesWhateverItsNumber) {
  layout("a.x");
  image(17);
  now += seconds(30);
  layout("a.x", 6);
  image(18, 6);
  now += seconds(30);
  image(19, 5);
  layout("b.x", 5);
  EXPECT_FALSE(is_certain());
  EXPECT_TRUE(is_certain_after(LayoutMatch::kRepair));
}

TEST_F(LayoutMatchTest, AnImageOfAReplacedWriterIsOvertaken) {
  image(17);
  const Snapshot late{.layout_id = 5, .sequence = 16, .acquired = now - milliseconds(10)};
  EXPECT_TRUE(match.is_overtaken(known_image, late, now + milliseconds(20)));
  EXPECT_FALSE(match.is_overtaken(known_image, late, now + LayoutMatch::kRepair));
  const Snapshot restarted{.layout_id = 5, .sequence = 1, .acquired = now + milliseconds(10)};
  EXPECT_FALSE(match.is_overtaken(known_image, restarted, now + milliseconds(20)));
}

TEST_F(LayoutMatchTest, ARepeatedImageShowsNothing) {
  layout("a.x");
  image(17);
  now += seconds(30);
  layout("b.x");
  now += seconds(2);
  match.take(known_image, *known_image, now);
  EXPECT_FALSE(is_certain_after(seconds(2)));
}

}  // namespace
}  // namespace linegate::image
