// SPDX-License-Identifier: Apache-2.0
// The lines that disappear with their publishers, the bound on the number of line names, and the
// participants that may answer for a line.
#include "bridges/dds/line_publishers.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::dds {
namespace {

using Right = LinePublishers::Right;
using std::chrono::milliseconds;

constexpr Instant kNoted{milliseconds(10'000)};

// A writer of that participant.
WriterGuid writer(std::uint8_t participant, std::uint8_t entity = 0) {
  WriterGuid out{1, 15, participant};
  out[15] = entity;
  return out;
}

ParticipantPrefix participant(std::uint8_t number) {
  return participant_of(writer(number));
}

class Publishers : public testing::Test {
 protected:
  bool note(const std::string& line, const WriterGuid& from, Instant now = kNoted) {
    return publishers.note("plant", line, from, now);
  }
  std::vector<std::string> lose(const WriterGuid& lost) {
    std::vector<std::string> gone;
    for (const auto& [gateway, line] : publishers.lose(lost))
      gone.push_back(gateway + "/" + line);
    return gone;
  }
  Right right(std::uint8_t number, Instant now = kNoted) {
    return publishers.right_of("plant", "press", participant(number), now);
  }

  LinePublishers publishers;
};

TEST_F(Publishers, AWriterIsLostWithItsLinesOnce) {
  EXPECT_TRUE(note("press", writer(1)));
  EXPECT_TRUE(note("hall", writer(1)));
  EXPECT_TRUE(note("yard", writer(2)));
  EXPECT_EQ(lose(writer(1)), (std::vector<std::string>{"plant/hall", "plant/press"}));
  EXPECT_TRUE(lose(writer(1)).empty());
}

TEST_F(Publishers, ALineMayGoWhileItsWriterStays) {
  note("press", writer(1));
  note("hall", writer(1));
  EXPECT_TRUE(publishers.forget("plant", "press", writer(1)));
  EXPECT_FALSE(publishers.forget("plant", "press", writer(1)));
  EXPECT_FALSE(publishers.forget("plant", "nobody", writer(1)));
  EXPECT_EQ(lose(writer(1)), std::vector<std::string>{"plant/hall"});
}

TEST_F(Publishers, AnotherParticipantEndsNoLine) {
  note("press", writer(1));
  EXPECT_FALSE(publishers.forget("plant", "press", writer(2)));
  EXPECT_EQ(right(1), Right::publisher);
}

TEST_F(Publishers, AGatewayThatStartedAgainIsNotGone) {
  note("press", writer(1));
  note("press", writer(2));
  EXPECT_TRUE(lose(writer(1)).empty());
  EXPECT_EQ(right(2), Right::publisher);
}

TEST_F(Publishers, AReplacedWriterOfTheSameParticipantIsNoDispute) {
  note("press", writer(1, 7));
  note("press", writer(1, 8));
  EXPECT_EQ(right(1), Right::publisher);
  EXPECT_TRUE(lose(writer(1, 7)).empty());
  EXPECT_EQ(lose(writer(1, 8)), std::vector<std::string>{"plant/press"});
}

TEST_F(Publishers, OnlyThePublisherMayAnswer) {
  EXPECT_EQ(right(1), Right::unknown);
  note("press", writer(1));
  EXPECT_EQ(right(1), Right::publisher);
  EXPECT_EQ(right(2), Right::foreign);
  note("hall", writer(2));
  EXPECT_EQ(right(2), Right::foreign) << "it publishes another line";
}

TEST_F(Publishers, TheGatewayAnswersForALineThatItDoesNotHave) {
  note("", writer(1));
  EXPECT_EQ(right(1), Right::publisher);
  EXPECT_EQ(right(2), Right::foreign);
  note("press", writer(2));
  EXPECT_EQ(right(1), Right::foreign) << "the line has a publisher of its own";
  EXPECT_TRUE(publishers.forget("plant", "press", writer(2)));
  EXPECT_EQ(right(1), Right::publisher) << "the line was removed";
}

TEST_F(Publishers, AWriterThatWasOnlyLateMayStillAnswer) {
  note("press", writer(1));
  lose(writer(1));
  EXPECT_EQ(right(1), Right::publisher);
  EXPECT_EQ(right(2), Right::foreign);
}

TEST_F(Publishers, ASecondPublisherWaitsUntilTheFirstIsSilent) {
  note("press", writer(1));
  note("press", writer(2));
  EXPECT_EQ(right(2, kNoted + milliseconds(1'999)), Right::contested);
  EXPECT_EQ(right(1, kNoted + milliseconds(1'999)), Right::contested);
  EXPECT_EQ(right(2, kNoted + milliseconds(2'000)), Right::publisher);
  EXPECT_EQ(right(1, kNoted + milliseconds(2'000)), Right::foreign);
}

TEST_F(Publishers, TwoThatBothPublishDisputeUntilOneIsLost) {
  note("press", writer(1));
  note("press", writer(2));
  note("press", writer(2));
  EXPECT_FALSE(publishers.disputed("plant", "press")) << "the first may have been killed";
  note("press", writer(1));
  EXPECT_TRUE(publishers.disputed("plant", "press"));
  EXPECT_EQ(right(1, kNoted + std::chrono::hours(1)), Right::disputed);
  EXPECT_EQ(right(2), Right::disputed);
  EXPECT_EQ(right(3), Right::foreign);
  EXPECT_EQ(publishers.publishers("plant", "press"),
            (std::vector<ParticipantPrefix>{participant(1), participant(2)}));
  EXPECT_TRUE(lose(writer(2)).empty());
  EXPECT_FALSE(publishers.disputed("plant", "press"));
  EXPECT_EQ(right(1), Right::publisher);
}

TEST_F(Publishers, MoreThanAreRecordedDisputeTheLine) {
  for (std::uint8_t i = 1; i <= LinePublishers::kMaxPublishers; ++i)
    note("press", writer(i));
  EXPECT_FALSE(publishers.disputed("plant", "press"));
  note("press", writer(100));
  EXPECT_TRUE(publishers.disputed("plant", "press"));
  EXPECT_EQ(publishers.publishers("plant", "press").size(), LinePublishers::kMaxPublishers);
}

TEST_F(Publishers, TheGatewayItselfIsNoLineThatIsGone) {
  note("", writer(1));
  EXPECT_EQ(publishers.right_of("plant", "", participant(1), kNoted), Right::publisher);
  EXPECT_TRUE(lose(writer(1)).empty());
}

TEST_F(Publishers, AreBoundedAndKnownLinesGoOn) {
  for (std::size_t i = 0; i < LinePublishers::kMaxLines; ++i) {
    ASSERT_TRUE(note(std::to_string(i), writer(1)));
  }
  EXPECT_FALSE(note("one more", writer(1)));
  EXPECT_TRUE(note("7", writer(2)));
  EXPECT_EQ(lose(writer(1)).size(), LinePublishers::kMaxLines - 1);
  EXPECT_TRUE(note("one more", writer(1))) << "there is room for a line again";
}

TEST(ParticipantPrefix, IsPrintedAsFastDdsDoes) {
  EXPECT_EQ(to_string(ParticipantPrefix{1, 15, 0xAB, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF}),
            "01.0f.ab.00|00.00.00.00|00.00.00.ff");
}

}  // namespace
}  // namespace linegate::dds
