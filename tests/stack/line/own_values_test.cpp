// Values that the configuration has for objects of the own node.
#include "stack/base/abort_code.h"
#include "stack/od/dictionary.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

class OwnValuesTest : public LineTest {
 protected:
  static ObjectValue value(std::uint16_t index, std::uint8_t sub,
                           std::initializer_list<unsigned> bytes) {
    ObjectValue out{.address = {index, sub}, .data = {}};
    for (const unsigned byte : bytes) {
      out.data.push_back(static_cast<std::byte>(byte));
    }
    return out;
  }
  std::uint64_t own(std::uint16_t index, std::uint8_t sub) {
    return line_->dictionary().number({index, sub}).value_or(0);
  }
};

TEST_F(OwnValuesTest, AreWrittenAtTheStartAndAfterEachReset) {
  LineConfig config = config_with_axis();
  config.own_values = {value(0x1007, 0, {0x20, 0x4E, 0, 0}), value(0x5F41, 8, {100, 0})};
  make(std::move(config));
  EXPECT_EQ(own(0x1007, 0), 0U);
  line_->start(now_);
  pass(milliseconds(1));
  EXPECT_EQ(own(0x1007, 0), 20'000U);
  EXPECT_EQ(own(0x1800, 5), 100U) << "5F41h:8 is the event timer of all TPDOs";
  ASSERT_TRUE(line_->dictionary().set({0x1007, 0}, 1U));
  Command command{.kind = CommandKind::nmt, .node = 127, .data = {}};
  command.nmt = nmt::Command::reset_node;
  line_->execute(std::move(command), now_);
  ASSERT_TRUE(answer().ok());
  EXPECT_EQ(own(0x1007, 0), 0U);
  pass(milliseconds(1));
  EXPECT_EQ(own(0x1007, 0), 20'000U);
  EXPECT_EQ(own(0x1800, 5), 100U);
}

TEST_F(OwnValuesTest, WhatIsRefusedIsToldAndTheOthersAreWritten) {
  LineConfig config = config_with_axis();
  config.own_values = {value(0x5F41, 5, {0, 0}), value(0x1007, 0, {1, 0, 0, 0})};
  make(std::move(config));
  line_->start(now_);
  EXPECT_EQ(own(0x1007, 0), 1U);
  const std::vector<Event> all = events();
  const auto refused = std::ranges::find(all, EventKind::configuration_error, &Event::kind);
  ASSERT_NE(refused, all.end());
  EXPECT_EQ(refused->node, 127);
  EXPECT_EQ(refused->code, static_cast<std::uint32_t>(AbortCode::value_too_low));
  EXPECT_EQ(refused->data[0], std::byte{0x41});
  EXPECT_EQ(refused->data[1], std::byte{0x5F});
  EXPECT_EQ(refused->data[2], std::byte{5});
}

}  // namespace
}  // namespace linegate::line
