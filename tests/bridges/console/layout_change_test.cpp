// SPDX-License-Identifier: Apache-2.0
// An output is written while the layout of the outputs changes, as after a reload.
#include <cstdint>
#include <initializer_list>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridges/console/commands.h"

#include "tests/bridges/console/command_test.h"
#include "tests/bridges/console/plant.h"

namespace linegate::console {
namespace {

image::Layout layout_of(std::uint64_t id, std::initializer_list<const char*> names) {
  image::Layout out{.direction = image::Direction::outputs, .id = id, .byte_size = 8};
  for (const char* const name : names) {
    out.entries.push_back({.bit_length = 8,
                           .type = od::DataType::unsigned8,
                           .node = static_cast<std::uint8_t>(name[4] - '0'),
                           .index = 0x6200,
                           .remote_pdo = 1,
                           .name = name});
  }
  return out;
}

// Publishes the layout of a new configuration before its answer.
class ReloadingGateway : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    listener.on_line(test::kPress, test::line_view(3));
    listener.on_node(test::kPress, {.name = "ram", .state = {.node = 5, .configured = true}});
    if (std::exchange(first_, false)) {
      listener.on_layout(test::kPress, layout_of(1, {"node5.First", "node5.Second"}));
    }
  }
  Answer call(const LineId& /*id*/, const line::Command& command, Duration /*timeout*/,
              std::uint64_t layout_id, Listener& listener) override {
    EXPECT_EQ(std::get<line::SingleOutput>(command.request).entry, 1U);
    EXPECT_EQ(layout_id, 1U);
    listener.on_layout(test::kPress, fresh);
    return answer;
  }

  image::Layout fresh = layout_of(2, {"node7.A", "node7.B"});
  Answer answer;

 private:
  bool first_ = true;
};

using LayoutChange = test::CommandTest<ReloadingGateway>;

TEST_F(LayoutChange, ARefusedOutputIsOfTheNodeThatTheEntryWasOf) {
  gateway_.answer.reply.error = line::to_error(line::Refusal::wrong_state);
  gateway_.answer.text = "not possible in the present state";
  EXPECT_EQ(write(context_, "press", "node5.Second", "1"), kFailed);
  EXPECT_EQ(err_.str(), "not possible in the present state: node 5 (ram) is not operational\n");
}

// The entries of the previous layout no longer exist.
TEST_F(LayoutChange, ALongerLayoutDoesNotMatterToARefusedOutput) {
  gateway_.fresh = layout_of(2, {"node7.A", "node7.B", "node7.C", "node7.D", "node7.E"});
  gateway_.answer.reply.error = line::to_error(line::Refusal::wrong_state);
  gateway_.answer.text = "not possible in the present state";
  EXPECT_EQ(write(context_, "press", "node5.Second", "1"), kFailed);
  EXPECT_THAT(err_.str(), testing::HasSubstr("node 5 (ram)"));
}

TEST_F(LayoutChange, TheEntriesInTheAnswerHaveTheNamesOfTheLayoutThatWasWrittenTo) {
  gateway_.fresh = layout_of(2, {"node7.A"});
  gateway_.answer.reply.data = line::WrittenByPdo{1, line::PdoWait::values, {0}};
  EXPECT_EQ(write(context_, "press", "node5.Second", "1"), kHeldBack);
  EXPECT_EQ(out_.str(), "by PDO 1, which waits for: values that were never written: node5.First\n");
}

}  // namespace
}  // namespace linegate::console
