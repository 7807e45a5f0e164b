// SPDX-License-Identifier: Apache-2.0
// Hooks that complete later, several hooks of one object, and groups of values.
#include <string>

#include <gtest/gtest.h>

#include "tests/stack/od/objects.h"

namespace linegate::od {
namespace {

using test::bytes;
using test::copy;
using test::object;
using test::var;
using test::variable;

constexpr Address kAt{0x2000, 1};

// Writes its calls into a log that it shares with other hooks.
class Scribe : public Hook {
 public:
  Scribe(std::string name, std::string& log) : name_(std::move(name)), log_(log) {}

  AbortCode before_read(Address, const Variable&) override { return note("read", answer); }
  AbortCode check_write(Address, std::span<const std::byte>) override {
    return note("check", answer);
  }
  void written(Address) override { note("written", AbortCode::none); }
  void put_off(Address, Ticket number) override {
    ticket = number;
    note("put off", AbortCode::none);
  }
  void cancelled(Ticket number) override {
    EXPECT_EQ(number, ticket);
    note("cancelled", AbortCode::none);
  }

  AbortCode answer = AbortCode::none;
  Ticket ticket = 0;

 private:
  AbortCode note(const char* what, AbortCode code) {
    log_ += name_ + ' ' + what + ';';
    return code;
  }

  std::string name_;
  std::string& log_;
};

class LaterTest : public testing::Test {
 protected:
  LaterTest() {
    EXPECT_TRUE(dictionary.add(
        object(kAt.index, ObjectType::array,
               {variable(0, DataType::unsigned8), variable(1, DataType::unsigned8, bytes({7}))})));
    EXPECT_TRUE(dictionary.set_hook(kAt.index, &service));
  }

  // The calls since the last time.
  std::string heard() { return std::exchange(log, {}); }

  Dictionary dictionary;
  std::string log;
  Scribe service{"service", log};
  Scribe application{"application", log};
  Ticket ticket = 0;
};

TEST_F(LaterTest, AllHooksAreAskedBeforeAnyIsTold) {
  ASSERT_TRUE(dictionary.add_hook(kAt.index, application));
  EXPECT_EQ(dictionary.write(kAt, bytes({9})), AbortCode::none);
  EXPECT_EQ(heard(), "service check;application check;service written;application written;");
  EXPECT_TRUE(dictionary.read(kAt));
  EXPECT_EQ(heard(), "service read;application read;");
}

TEST_F(LaterTest, OneHookOfSeveralRefusesForAll) {
  ASSERT_TRUE(dictionary.add_hook(kAt.index, application));
  application.answer = AbortCode::local_control;
  EXPECT_EQ(dictionary.write(kAt, bytes({9})), AbortCode::local_control);
  EXPECT_EQ(heard(), "service check;application check;");
  EXPECT_EQ(dictionary.number(kAt), 7U);
  service.answer = AbortCode::hardware;
  EXPECT_EQ(dictionary.write(kAt, bytes({9})), AbortCode::hardware);
  EXPECT_EQ(heard(), "service check;");
}

TEST_F(LaterTest, TheHookOfTheServiceMayChangeBelowTheOthers) {
  ASSERT_TRUE(dictionary.add_hook(kAt.index, application));
  ASSERT_TRUE(dictionary.set_hook(kAt.index, nullptr));
  EXPECT_EQ(dictionary.write(kAt, bytes({9})), AbortCode::none);
  EXPECT_EQ(heard(), "application check;application written;");
  ASSERT_TRUE(dictionary.set_hook(kAt.index, &service));
  dictionary.remove_hook(kAt.index, application);
  EXPECT_EQ(dictionary.write(kAt, bytes({9})), AbortCode::none);
  EXPECT_EQ(heard(), "service check;service written;");
  EXPECT_EQ(dictionary.add_hook(0x2001, application).error(), to_error(AbortCode::no_object));
}

TEST_F(LaterTest, AReadWaitsAndGivesTheValueOfThen) {
  service.answer = kLater;
  EXPECT_EQ(dictionary.read(kAt, ticket).error(), to_error(kLater));
  EXPECT_EQ(heard(), "service read;service put off;");
  EXPECT_EQ(ticket, service.ticket);
  EXPECT_EQ(dictionary.outcome(ticket), std::nullopt);
  ASSERT_TRUE(dictionary.set(kAt, 42));
  EXPECT_TRUE(dictionary.complete(ticket, AbortCode::none));
  EXPECT_EQ(dictionary.outcome(ticket), AbortCode::none);
  EXPECT_EQ(copy(*dictionary.finish_read(ticket)), bytes({42}));
  EXPECT_EQ(dictionary.outcome(ticket), AbortCode::no_data) << "the ticket is used";
  EXPECT_FALSE(dictionary.complete(ticket, AbortCode::none));
}

TEST_F(LaterTest, AWriteWaitsAndChangesNothingBefore) {
  service.answer = kLater;
  EXPECT_EQ(dictionary.write(kAt, bytes({9}), ticket), kLater);
  EXPECT_EQ(dictionary.number(kAt), 7U);
  EXPECT_TRUE(dictionary.complete(ticket, AbortCode::none));
  EXPECT_EQ(dictionary.number(kAt), 7U);
  EXPECT_EQ(heard(), "service check;service put off;");
  EXPECT_EQ(dictionary.finish_write(ticket, bytes({9})), AbortCode::none);
  EXPECT_EQ(dictionary.number(kAt), 9U);
  EXPECT_EQ(heard(), "service written;");
}

TEST_F(LaterTest, TheLateAnswerMayBeARefusal) {
  service.answer = kLater;
  ASSERT_EQ(dictionary.write(kAt, bytes({9}), ticket), kLater);
  EXPECT_TRUE(dictionary.complete(ticket, AbortCode::hardware));
  EXPECT_FALSE(dictionary.complete(ticket, AbortCode::none)) << "the first completion counts";
  EXPECT_EQ(dictionary.finish_write(ticket, bytes({9})), AbortCode::hardware);
  EXPECT_EQ(dictionary.number(kAt), 7U);
  ASSERT_FALSE(dictionary.read(kAt, ticket));
  EXPECT_FALSE(dictionary.complete(ticket, kLater)) << "kLater is not a completion";
  EXPECT_TRUE(dictionary.complete(ticket, AbortCode::no_data));
  EXPECT_EQ(dictionary.finish_read(ticket).error(), to_error(AbortCode::no_data));
}

TEST_F(LaterTest, WhoCannotWaitIsRefused) {
  service.answer = kLater;
  EXPECT_EQ(dictionary.read(kAt).error(), to_error(AbortCode::device_state));
  EXPECT_EQ(dictionary.check(kAt, bytes({9})), AbortCode::device_state);
  EXPECT_EQ(dictionary.write(kAt, bytes({9})), AbortCode::device_state);
  const std::byte nine{9};
  const Assignment group[] = {{kAt, {&nine, 1}}};
  EXPECT_EQ(dictionary.write_all(group), AbortCode::device_state);
  EXPECT_EQ(heard(), "service read;service check;service check;service check;");
}

TEST_F(LaterTest, AccessesWaitSideBySide) {
  service.answer = kLater;
  Ticket second = 0;
  ASSERT_EQ(dictionary.write(kAt, bytes({9}), ticket), kLater);
  ASSERT_EQ(dictionary.write({kAt.index, 0}, bytes({3}), second), kLater);
  EXPECT_NE(ticket, second);
  EXPECT_TRUE(dictionary.complete(second, AbortCode::none));
  EXPECT_EQ(dictionary.outcome(ticket), std::nullopt);
  EXPECT_EQ(dictionary.finish_write(second, bytes({3})), AbortCode::none);
  EXPECT_EQ(dictionary.finish_write(ticket, bytes({9})), AbortCode::device_state)
      << "not completed yet";
}

TEST_F(LaterTest, WhatIsGivenUpIsTold) {
  service.answer = kLater;
  ASSERT_FALSE(dictionary.read(kAt, ticket));
  heard();
  dictionary.cancel(ticket);
  EXPECT_EQ(heard(), "service cancelled;");
  EXPECT_FALSE(dictionary.complete(ticket, AbortCode::none));
  ASSERT_FALSE(dictionary.read(kAt, ticket));
  ASSERT_TRUE(dictionary.complete(ticket, AbortCode::none));
  heard();
  dictionary.cancel(ticket);
  EXPECT_EQ(heard(), "") << "already completed";
}

TEST_F(LaterTest, OnlyTheHookThatAnswersLaterHearsOfIt) {
  ASSERT_TRUE(dictionary.add_hook(kAt.index, application));
  application.answer = kLater;
  ASSERT_EQ(dictionary.write(kAt, bytes({9}), ticket), kLater);
  EXPECT_EQ(heard(), "service check;application check;application put off;");
  dictionary.cancel(ticket);
  EXPECT_EQ(heard(), "application cancelled;");
  service.answer = kLater;
  EXPECT_EQ(dictionary.write(kAt, bytes({9}), ticket), AbortCode::device_incompatible)
      << "only one hook may complete later";
}

TEST_F(LaterTest, AHookThatIsTakenAwayLeavesNobodyWaiting) {
  ASSERT_TRUE(dictionary.add_hook(kAt.index, application));
  application.answer = kLater;
  ASSERT_EQ(dictionary.write(kAt, bytes({9}), ticket), kLater);
  dictionary.remove_hook(kAt.index, application);
  EXPECT_EQ(dictionary.outcome(ticket), AbortCode::device_state);
  service.answer = kLater;
  Ticket second = 0;
  ASSERT_EQ(dictionary.write(kAt, bytes({9}), second), kLater);
  ASSERT_TRUE(dictionary.set_hook(kAt.index, nullptr));
  EXPECT_EQ(dictionary.finish_write(second, bytes({9})), AbortCode::device_state);
}

TEST_F(LaterTest, AnObjectThatIsRemovedLeavesNobodyWaiting) {
  service.answer = kLater;
  ASSERT_EQ(dictionary.write(kAt, bytes({9}), ticket), kLater);
  ASSERT_TRUE(dictionary.remove(kAt.index));
  EXPECT_EQ(dictionary.outcome(ticket), AbortCode::no_object);
  heard();
  dictionary.cancel(ticket);
  EXPECT_EQ(heard(), "");
}

TEST_F(LaterTest, TheObjectMayBeAnotherOneWhenTheAnswerComes) {
  service.answer = kLater;
  ASSERT_EQ(dictionary.write(kAt, bytes({9}), ticket), kLater);
  ASSERT_TRUE(dictionary.complete(ticket, AbortCode::none));
  ASSERT_TRUE(dictionary.remove(kAt.index));
  ASSERT_TRUE(dictionary.add(
      object(kAt.index, ObjectType::array,
             {variable(0, DataType::unsigned8), variable(1, DataType::unsigned16)})));
  EXPECT_EQ(dictionary.finish_write(ticket, bytes({9})), AbortCode::length_too_low);
}

class GroupTest : public LaterTest {
 protected:
  GroupTest() {
    ObjectDescription limited = var(0x2001, DataType::unsigned8, bytes({1}));
    limited.variables[0].high_limit = bytes({50});
    EXPECT_TRUE(dictionary.add(limited));
    EXPECT_TRUE(dictionary.set_hook(0x2001, &application));
  }

  AbortCode write(unsigned first, unsigned second) {
    const auto one = bytes({first});
    const auto two = bytes({second});
    const Assignment group[] = {{kAt, one}, {{0x2001, 0}, two}};
    return dictionary.write_all(group, &refused);
  }

  std::size_t refused = 99;
};

TEST_F(GroupTest, EverythingIsCheckedBeforeAnythingIsStored) {
  EXPECT_EQ(write(9, 50), AbortCode::none);
  EXPECT_EQ(heard(), "service check;application check;service written;application written;");
  EXPECT_EQ(dictionary.number(kAt), 9U);
  EXPECT_EQ(dictionary.number({0x2001, 0}), 50U);
  EXPECT_EQ(refused, 99U);
}

TEST_F(GroupTest, OneRefusalLeavesAllAsTheyAre) {
  EXPECT_EQ(write(9, 51), AbortCode::value_too_high);
  EXPECT_EQ(refused, 1U);
  application.answer = AbortCode::device_state;
  EXPECT_EQ(write(9, 50), AbortCode::device_state);
  service.answer = AbortCode::local_control;
  EXPECT_EQ(write(9, 50), AbortCode::local_control);
  EXPECT_EQ(refused, 0U);
  EXPECT_EQ(dictionary.number(kAt), 7U);
  EXPECT_EQ(dictionary.number({0x2001, 0}), 1U);
  EXPECT_EQ(heard(), "service check;service check;application check;service check;");
}

// A hook that reads the other value of its group when it is called after a write.
class Onlooker : public Hook {
 public:
  explicit Onlooker(const Dictionary& dictionary) : dictionary_(dictionary) {}
  void written(Address) override { seen = dictionary_.number({0x2001, 0}).value_or(0); }
  std::uint64_t seen = 0;

 private:
  const Dictionary& dictionary_;
};

TEST_F(GroupTest, AllAreStoredBeforeTheFirstHookIsTold) {
  Onlooker onlooker(dictionary);
  ASSERT_TRUE(dictionary.set_hook(kAt.index, &onlooker));
  EXPECT_EQ(write(9, 33), AbortCode::none);
  EXPECT_EQ(onlooker.seen, 33U);
}

}  // namespace
}  // namespace linegate::od
