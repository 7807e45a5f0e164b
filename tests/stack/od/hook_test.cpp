// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "tests/stack/od/objects.h"

namespace linegate::od {
namespace {

using test::bytes;
using test::copy;
using test::object;
using test::var;
using test::variable;

class Recorder : public Hook {
 public:
  AbortCode before_read(Address address, const Variable& variable) override {
    calls += "read " + std::to_string(address.sub) + ';';
    if (fresh != 0) {
      *variable.data = static_cast<std::byte>(fresh);
    }
    return refusal;
  }
  AbortCode check_write(Address address, std::span<const std::byte> value) override {
    calls += "check " + std::to_string(address.sub) + '=' + std::to_string(load_le(value)) + ';';
    return refusal;
  }
  void written(Address address) override {
    calls += "written " + std::to_string(address.sub) + ';';
  }

  std::string calls;
  AbortCode refusal = AbortCode::none;
  unsigned fresh = 0;
};

constexpr FollowMark kMark = 7;

class Follower : public Observer {
 public:
  explicit Follower(Dictionary& dictionary) : dictionary_(dictionary) {
    dictionary.add_observer(*this);
  }
  ~Follower() override { dictionary_.remove_observer(*this); }
  void reshaped(std::uint16_t) override {}
  void changed(Address address, FollowMark mark) override {
    last_mark = mark;
    changes += std::to_string(address.sub) + '=' +
               std::to_string(dictionary_.number(address).value_or(0)) + ';';
  }
  std::string heard() { return std::exchange(changes, {}); }

  std::string changes;
  FollowMark last_mark = 0;

 private:
  Dictionary& dictionary_;
};

Dictionary array_with(Hook& hook) {
  Dictionary dictionary;
  ObjectDescription description =
      object(0x2000, ObjectType::array,
             {variable(0, DataType::unsigned8), variable(2, DataType::unsigned8, bytes({1}))});
  description.variables[1].high_limit = bytes({50});
  EXPECT_TRUE(dictionary.add(description));
  EXPECT_TRUE(dictionary.set_hook(0x2000, &hook));
  return dictionary;
}

TEST(Hook, MayRefreshAValueBeforeItIsRead) {
  Recorder hook;
  Dictionary dictionary = array_with(hook);
  hook.fresh = 42;
  EXPECT_EQ(copy(*dictionary.read({0x2000, 2})), bytes({42}));
  EXPECT_EQ(hook.calls, "read 2;");
}

TEST(Hook, MayRefuseARead) {
  Recorder hook;
  Dictionary dictionary = array_with(hook);
  hook.refusal = AbortCode::no_data;
  EXPECT_EQ(dictionary.read({0x2000, 0}).error(), to_error(AbortCode::no_data));
}

// 1021h, 1022h stored EDS, 1023h to 1026h OS command and prompt
TEST(Hook, IsAskedLastAndToldAfterwards) {
  Recorder hook;
  Dictionary dictionary = array_with(hook);
  EXPECT_EQ(dictionary.write({0x2000, 2}, bytes({51})), AbortCode::value_too_high);
  EXPECT_EQ(dictionary.write({0x2000, 2}, bytes({1, 2})), AbortCode::length_too_high);
  EXPECT_EQ(hook.calls, "");
  EXPECT_EQ(dictionary.check({0x2000, 2}, bytes({50})), AbortCode::none);
  EXPECT_EQ(hook.calls, "check 2=50;");
  EXPECT_EQ(dictionary.write({0x2000, 2}, bytes({50})), AbortCode::none);
  EXPECT_EQ(hook.calls, "check 2=50;check 2=50;written 2;");
}

// Executes the order of a write, and may fail.
class Worker final : public Recorder {
 public:
  AbortCode execute_write(Address address, std::span<const std::byte> value) override {
    calls += "execute " + std::to_string(address.sub) + '=' + std::to_string(load_le(value)) + ';';
    return failure;
  }
  AbortCode failure = AbortCode::none;
};

TEST(Hook, ExecutesWhenAllChecksHavePassed) {
  Worker hook;
  Recorder other;
  Dictionary dictionary = array_with(hook);
  ASSERT_TRUE(dictionary.add_hook(0x2000, other));
  EXPECT_EQ(dictionary.check({0x2000, 2}, bytes({9})), AbortCode::none);
  other.refusal = AbortCode::device_state;
  EXPECT_EQ(dictionary.write({0x2000, 2}, bytes({9})), AbortCode::device_state);
  EXPECT_EQ(std::exchange(hook.calls, ""), "check 2=9;check 2=9;");

  other.refusal = AbortCode::none;
  EXPECT_EQ(dictionary.write({0x2000, 2}, bytes({9})), AbortCode::none);
  EXPECT_EQ(std::exchange(hook.calls, ""), "check 2=9;execute 2=9;written 2;");
  EXPECT_TRUE(dictionary.set({0x2000, 2}, 7));
  EXPECT_EQ(std::exchange(hook.calls, ""), "written 2;");

  hook.failure = AbortCode::hardware;
  Ticket ticket = 0;
  EXPECT_EQ(dictionary.write({0x2000, 2}, bytes({8})), AbortCode::hardware);
  EXPECT_EQ(dictionary.write({0x2000, 2}, bytes({8}), ticket), AbortCode::hardware);
  EXPECT_EQ(std::exchange(hook.calls, ""), "check 2=8;execute 2=8;check 2=8;execute 2=8;");
  EXPECT_EQ(dictionary.number({0x2000, 2}), 7U);
}

TEST(Hook, ARefusedWriteChangesNothing) {
  Recorder hook;
  Dictionary dictionary = array_with(hook);
  hook.refusal = AbortCode::device_state;
  EXPECT_EQ(dictionary.write({0x2000, 2}, bytes({9})), AbortCode::device_state);
  EXPECT_EQ(hook.calls, "check 2=9;");
  EXPECT_EQ(dictionary.number({0x2000, 2}), 1U);
}

TEST(Hook, IsToldAboutValuesTheDeviceSetsItself) {
  Recorder hook;
  Dictionary dictionary = array_with(hook);
  hook.refusal = AbortCode::device_state;
  EXPECT_TRUE(dictionary.set({0x2000, 2}, 200));
  EXPECT_EQ(hook.calls, "written 2;");
}

TEST(Hook, IsNotCalledForNumbersAndResets) {
  Recorder hook;
  Dictionary dictionary = array_with(hook);
  EXPECT_EQ(dictionary.number({0x2000, 2}), 1U);
  dictionary.reset_values(0, 0xFFFF);
  EXPECT_EQ(hook.calls, "");
}

TEST(Hook, CanBeTakenAway) {
  Recorder hook;
  Dictionary dictionary = array_with(hook);
  ASSERT_TRUE(dictionary.set_hook(0x2000, nullptr));
  EXPECT_EQ(dictionary.write({0x2000, 2}, bytes({3})), AbortCode::none);
  EXPECT_EQ(hook.calls, "");
  EXPECT_EQ(dictionary.set_hook(0x2001, &hook).error(), to_error(AbortCode::no_object));
}

TEST(Hook, SeesTheElementsOfAWindow) {
  std::array<std::byte, 3> image{};
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add_window(0xA4C0, DataType::unsigned8, Access::rww, image.data(), 3));
  Recorder hook;
  ASSERT_TRUE(dictionary.set_hook(0xA4C0, &hook));
  EXPECT_EQ(dictionary.write({0xA4C0, 3}, bytes({7})), AbortCode::none);
  EXPECT_EQ(hook.calls, "check 3=7;written 3;");
  hook.fresh = 8;
  EXPECT_EQ(copy(*dictionary.read({0xA4C0, 2})), bytes({8}));
  EXPECT_EQ(copy(image), bytes({0, 8, 7}));
}

TEST(Hook, TheDefaultDoesNothing) {
  Hook hook;
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(var(0x2000, DataType::unsigned8)));
  ASSERT_TRUE(dictionary.set_hook(0x2000, &hook));
  EXPECT_EQ(dictionary.write({0x2000, 0}, bytes({3})), AbortCode::none);
  EXPECT_TRUE(dictionary.read({0x2000, 0}));
}

TEST(Restore, GivesAValueOfTheRightLengthWithoutAHook) {
  Recorder hook;
  Dictionary dictionary = array_with(hook);
  EXPECT_TRUE(dictionary.restore({0x2000, 2}, bytes({7})));
  EXPECT_EQ(dictionary.number({0x2000, 2}), 7U);
  EXPECT_FALSE(dictionary.restore({0x2000, 2}, bytes({7, 0})));
  EXPECT_FALSE(dictionary.restore({0x2000, 1}, bytes({7})));
  EXPECT_EQ(hook.calls, "");
}

TEST(Followed, ValuesAreToldWhenTheyAreOtherOnes) {
  Recorder hook;
  Dictionary dictionary = array_with(hook);
  Follower follower(dictionary);
  EXPECT_TRUE(dictionary.set({0x2000, 2}, 7));
  EXPECT_EQ(follower.heard(), "") << "the value is not followed";
  ASSERT_TRUE(dictionary.follow({0x2000, 2}, kMark));
  EXPECT_EQ(dictionary.follow({0x2000, 1}, kMark).error(), to_error(AbortCode::no_sub_index));
  EXPECT_EQ(dictionary.follow({0x2001, 0}, kMark).error(), to_error(AbortCode::no_object));
  EXPECT_TRUE(dictionary.set({0x2000, 2}, 8));
  EXPECT_EQ(follower.heard(), "2=8;");
  EXPECT_EQ(follower.last_mark, kMark);
  EXPECT_EQ(dictionary.write({0x2000, 2}, bytes({9})), AbortCode::none);
  EXPECT_EQ(follower.heard(), "2=9;");
  EXPECT_TRUE(dictionary.set({0x2000, 2}, 9));
  EXPECT_EQ(dictionary.write({0x2000, 2}, bytes({9})), AbortCode::none);
  EXPECT_EQ(dictionary.write({0x2000, 2}, bytes({51})), AbortCode::value_too_high);
  EXPECT_TRUE(dictionary.set({0x2000, 0}, 9));
  EXPECT_TRUE(dictionary.restore({0x2000, 2}, bytes({3})));
  dictionary.reset_values(0, 0xFFFF);
  dictionary.came_by_rpdo({0x2000, 2});
  EXPECT_EQ(follower.heard(), "");
  ASSERT_TRUE(dictionary.follow({0x2000, 2}, 0));
  EXPECT_TRUE(dictionary.set({0x2000, 2}, 4));
  EXPECT_EQ(follower.heard(), "");
}

TEST(Followed, AfterTheHooksAndInAGroupAfterAllOfThem) {
  struct Sets : Hook {
    explicit Sets(Dictionary& d, Follower& f) : dictionary(d), follower(f) {}
    void written(Address address) override {
      heard_before += follower.changes;
      if (address.sub == 2) {
        dictionary.set({0x2000, 0}, 5);
      }
    }
    Dictionary& dictionary;
    Follower& follower;
    std::string heard_before;
  };
  Recorder none;
  Dictionary dictionary = array_with(none);
  Follower follower(dictionary);
  Sets hook(dictionary, follower);
  ASSERT_TRUE(dictionary.set_hook(0x2000, &hook));
  ASSERT_TRUE(dictionary.follow({0x2000, 0}, kMark));
  ASSERT_TRUE(dictionary.follow({0x2000, 2}, kMark));
  EXPECT_EQ(dictionary.write({0x2000, 2}, bytes({9})), AbortCode::none);
  EXPECT_EQ(hook.heard_before, "");
  EXPECT_EQ(follower.heard(), "0=5;2=9;");
  EXPECT_EQ(follower.last_mark, kMark);
  ASSERT_TRUE(dictionary.set_hook(0x2000, nullptr));
  const auto first = bytes({6});
  const auto second = bytes({10});
  const Assignment group[] = {{{0x2000, 0}, first}, {{0x2000, 2}, second}};
  EXPECT_EQ(dictionary.write_all(group), AbortCode::none);
  EXPECT_EQ(follower.heard(), "0=6;2=10;");
  EXPECT_EQ(dictionary.write_all(group), AbortCode::none);
  EXPECT_EQ(follower.heard(), "") << "the values did not change";
}

TEST(Followed, WithTheMarkThatItHasAfterTheHooks) {
  struct Unfollows : Hook {
    explicit Unfollows(Dictionary& d) : dictionary(d) {}
    void written(Address address) override { ASSERT_TRUE(dictionary.follow(address, mark)); }
    Dictionary& dictionary;
    FollowMark mark = kMark + 1;
  };
  Recorder none;
  Dictionary dictionary = array_with(none);
  Follower follower(dictionary);
  Unfollows hook(dictionary);
  ASSERT_TRUE(dictionary.set_hook(0x2000, &hook));
  ASSERT_TRUE(dictionary.follow({0x2000, 2}, kMark));
  EXPECT_TRUE(dictionary.set({0x2000, 2}, 8));
  EXPECT_EQ(follower.heard(), "2=8;");
  EXPECT_EQ(follower.last_mark, kMark + 1);
  hook.mark = 0;
  EXPECT_EQ(dictionary.write({0x2000, 2}, bytes({9})), AbortCode::none);
  EXPECT_EQ(follower.heard(), "");
}

TEST(Followed, OnceAWriteThatWaitedIsDone) {
  Recorder hook;
  Dictionary dictionary = array_with(hook);
  Follower follower(dictionary);
  ASSERT_TRUE(dictionary.follow({0x2000, 2}, kMark));
  hook.refusal = kLater;
  Ticket ticket = 0;
  EXPECT_EQ(dictionary.write({0x2000, 2}, bytes({9}), ticket), kLater);
  EXPECT_TRUE(dictionary.complete(ticket, AbortCode::none));
  EXPECT_EQ(follower.heard(), "");
  EXPECT_EQ(dictionary.finish_write(ticket, bytes({9})), AbortCode::none);
  EXPECT_EQ(follower.heard(), "2=9;");
}

TEST(Followed, AllElementsOfAWindowAndOfNoObjectAfterIt) {
  std::array<std::byte, 3> image{};
  Dictionary dictionary;
  ASSERT_TRUE(dictionary.add_window(0xA4C0, DataType::unsigned8, Access::rww, image.data(), 3));
  Follower follower(dictionary);
  ASSERT_TRUE(dictionary.follow({0xA4C0, 2}, kMark));
  EXPECT_EQ(dictionary.write({0xA4C0, 3}, bytes({7})), AbortCode::none);
  EXPECT_EQ(follower.heard(), "3=7;");
  EXPECT_EQ(follower.last_mark, kSharedMark);
  ASSERT_TRUE(dictionary.remove(0xA4C0));
  ASSERT_TRUE(dictionary.add(var(0xA4C0, DataType::unsigned8)));
  EXPECT_TRUE(dictionary.set({0xA4C0, 0}, 1));
  EXPECT_EQ(follower.heard(), "");
}

}  // namespace
}  // namespace linegate::od
