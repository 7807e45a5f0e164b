// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/retained_messages.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::dds {
namespace {

using Key = RetainedMessages::Key;
constexpr RetainedMessages::Policy kNewestState{};
constexpr RetainedMessages::Policy kThreeEvents{.depth = 3};
constexpr RetainedMessages::Policy kThreeImages{.depth = 3, .once = true, .newest_always = true};
constexpr RetainedMessages::Policy kOnce{.depth = 3, .once = true};

void add(RetainedMessages& to, const Key& key, RetainedMessages::Policy policy, char content) {
  RetainedMessages::Message message{static_cast<std::byte>(content)};
  to.add(key, policy, message);
}

// Sends up to `most` messages; the position is the number of messages since the last restart.
std::string send(RetainedMessages& from, std::uint64_t& position, std::size_t most = 100) {
  std::string out;
  while (from.next() != nullptr && out.size() < most) {
    out += static_cast<char>(from.next()->front());
    from.note_sent(++position);
  }
  return out;
}

TEST(RetainedMessages, ANewerStateReplacesAnOlderOneAndMovesToTheEnd) {
  RetainedMessages messages;
  std::uint64_t position = 0;
  add(messages, {"a", 1}, kNewestState, 'a');
  add(messages, {"b", 1}, kNewestState, 'b');
  add(messages, {"a", 1}, kNewestState, 'A');
  EXPECT_EQ(send(messages, position), "bA");
  add(messages, {"b", 1}, kNewestState, 'B');
  EXPECT_EQ(send(messages, position), "B");
  EXPECT_EQ(messages.size(), 2U);
  EXPECT_EQ(messages.lost(), 0U);
}

TEST(RetainedMessages, AnotherProcessReceivesStatesAndHistoryInTheirOrder) {
  RetainedMessages messages;
  std::uint64_t position = 0;
  add(messages, {"a", 1}, kNewestState, 's');
  for (const char event : std::string("12345")) {
    add(messages, {"a", 2}, kThreeEvents, event);
    send(messages, position);
  }
  messages.note_done(position);
  messages.restart();
  position = 0;
  EXPECT_EQ(send(messages, position), "s345");
  EXPECT_EQ(messages.lost(), 0U);
}

TEST(RetainedMessages, CountsWhatIsDroppedBeforeItWasSent) {
  RetainedMessages messages;
  std::uint64_t position = 0;
  for (const char event : std::string("12345"))
    add(messages, {"a", 2}, kThreeEvents, event);
  EXPECT_EQ(messages.lost(), 2U);
  EXPECT_EQ(send(messages, position), "345");
}

TEST(RetainedMessages, WhatWasCarriedOutOnceIsNotSentAgain) {
  RetainedMessages messages;
  std::uint64_t position = 0;
  for (const char reception : std::string("123"))
    add(messages, {"a", 3}, kOnce, reception);
  send(messages, position);
  messages.note_done(2);
  messages.restart();
  position = 0;
  EXPECT_EQ(send(messages, position), "3");
  messages.note_done(position);
  EXPECT_EQ(messages.size(), 0U);
}

TEST(RetainedMessages, TheNewestImageIsSentToEachProcess) {
  RetainedMessages messages;
  std::uint64_t position = 0;
  const Key key{"a", 4};
  for (const char image : std::string("123"))
    add(messages, key, kThreeImages, image);
  EXPECT_EQ(messages.pending(key), 3U);
  send(messages, position);
  EXPECT_EQ(messages.pending(key), 3U) << "sent, and not carried out";
  messages.note_done(1);
  EXPECT_EQ(messages.pending(key), 2U);
  messages.note_done(3);
  EXPECT_EQ(messages.pending(key), 0U);
  EXPECT_EQ(messages.size(), 1U);
  messages.restart();
  position = 0;
  EXPECT_EQ(send(messages, position), "3");
}

TEST(RetainedMessages, AMessageThatIsReplacedWhileItIsUnderWayIsNotSentAgain) {
  RetainedMessages messages;
  std::uint64_t position = 0;
  constexpr RetainedMessages::Policy kUpdate{.once = true};
  RetainedMessages::Message update{std::byte{'u'}};
  messages.add({"a", 5}, kUpdate, update, 7);
  EXPECT_EQ(messages.unsent_tally({"a", 5}), 7U);
  send(messages, position);
  EXPECT_EQ(messages.unsent_tally({"a", 5}), 0U);
  add(messages, {"a", 5}, kUpdate, 'v');
  EXPECT_EQ(send(messages, position), "v");
  messages.note_done(1);
  EXPECT_EQ(messages.size(), 1U);
  messages.note_done(2);
  EXPECT_EQ(messages.size(), 0U);
}

TEST(RetainedMessages, ForgetsAKeyThatIsUsedOnce) {
  RetainedMessages messages;
  std::uint64_t position = 0;
  for (int i = 0; i < 100; ++i) {
    add(messages, {"", 7, std::to_string(i)}, {.once = true, .only = true}, 'e');
    add(messages, {"a", 3}, kOnce, 'o');
    EXPECT_EQ(send(messages, position), "eo");
    messages.note_done(position);
    EXPECT_EQ(messages.size(), 0U);
    EXPECT_EQ(messages.keys(), 1U) << "the other one, whose room is used again";
  }
}

TEST(RetainedMessages, DropsAllOfALineWhereverTheyAre) {
  RetainedMessages messages;
  std::uint64_t position = 0;
  add(messages, {"a", 1}, kNewestState, '1');
  add(messages, {"a", 3}, kOnce, '2');
  send(messages, position);
  add(messages, {"b", 1}, kNewestState, '3');
  add(messages, {"a", 3}, kOnce, '4');
  messages.drop([](const Key& key) { return key.line == "a"; });
  EXPECT_FALSE(messages.contains({"a", 1}));
  EXPECT_EQ(send(messages, position), "3");
  messages.note_done(position);
  EXPECT_EQ(messages.size(), 1U);
}

}  // namespace
}  // namespace linegate::dds
