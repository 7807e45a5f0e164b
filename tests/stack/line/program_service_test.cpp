// SPDX-License-Identifier: Apache-2.0
#include "stack/line/program_service.h"

#include <gtest/gtest.h>

#include "tests/stack/line/service_fixture.h"

namespace linegate::line {
namespace {

constexpr Duration kAnswerTime = milliseconds(500);

struct ProgramServiceTest : testing::Test {
  Command command(std::uint8_t node, std::uint8_t number, std::size_t bytes) {
    return {.tag = ++tag,
            .timeout = seconds(2),
            .request = ProgramDownload{
                .node = node, .number = number, .program = std::vector<std::byte>(bytes)}};
  }

  ManagerParts parts;
  RecordingHost host;
  manager::ProgramLoader loader{parts.dictionary, node_plans(parts.config), parts.sdo, parts.events,
                                kAnswerTime,      CommandKind::program};
  ProgramService service{host, parts.manager, loader, parts.config.node_id};
  std::uint64_t tag = 0;
};

TEST_F(ProgramServiceTest, IsRefusedWhereItMakesNoSense) {
  service.execute(command(0, 1, 8), parts.now);
  service.execute(command(5, 0, 8), parts.now);
  service.execute(command(5, 1, 0), parts.now);
  service.execute(command(parts.config.node_id, 1, 8), parts.now);
  for (std::uint64_t each = 1; each <= tag; ++each) {
    EXPECT_EQ(host.answer(each), to_error(Refusal::bad_request)) << each;
  }
  parts.manager.stop(parts.now);
  service.execute(command(5, 1, 8), parts.now);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_state));
  host.set_usable(false);
  service.execute(command(5, 1, 8), parts.now);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::line_down));
  host.set_manages(false);
  service.execute(command(5, 1, 8), parts.now);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_role));
}

TEST_F(ProgramServiceTest, HoldsTheNodeUntilItsTimeIsOver) {
  service.execute(command(5, 1, 8), parts.now);
  EXPECT_TRUE(service.active());
  EXPECT_TRUE(parts.manager.held(5));
  service.execute(command(5, 1, 8), parts.now);
  EXPECT_EQ(host.answer(2), to_error(Refusal::busy));
  service.advance(parts.now + seconds(2));
  EXPECT_EQ(host.answer(1), to_error(Refusal::timed_out));
  EXPECT_FALSE(parts.manager.held(5));
  EXPECT_FALSE(service.active());
}

TEST_F(ProgramServiceTest, EndReleasesTheNode) {
  service.execute(command(5, 1, 8), parts.now);
  service.end(Refusal::cancelled, parts.now);
  EXPECT_EQ(host.answer(1), to_error(Refusal::cancelled));
  EXPECT_FALSE(parts.manager.held(5));
  service.end(Refusal::cancelled, parts.now);
}

}  // namespace
}  // namespace linegate::line
