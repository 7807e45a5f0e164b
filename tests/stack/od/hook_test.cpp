#include <array>
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

}  // namespace
}  // namespace linegate::od
