// SPDX-License-Identifier: Apache-2.0
#include "stack/line/configure_service.h"

#include <array>
#include <span>

#include <gtest/gtest.h>

#include "tests/stack/line/service_fixture.h"

namespace linegate::line {
namespace {

constexpr Duration kSdoTimeout = milliseconds(500);

struct ConfigureServiceTest : testing::Test {
  void execute(std::uint8_t node, std::uint16_t code, Duration timeout = {}) {
    service.execute({.tag = ++tag,
                     .kind = CommandKind::configure,
                     .node = node,
                     .code = code,
                     .timeout = timeout,
                     .data = {}},
                    parts.now);
  }

  ManagerParts parts;
  RecordingHost host;
  manager::Configurator configurator{parts.dictionary, node_plans(parts.config), parts.sdo,
                                     parts.events, kSdoTimeout};
  ConfigureService service{host, parts.manager, configurator, parts.events};
  std::uint64_t tag = 0;
};

TEST_F(ConfigureServiceTest, IsRefusedWhereItMakesNoSense) {
  execute(5, 2);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::bad_request));
  execute(6, 0);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::bad_request));
  host.set_usable(false);
  execute(5, 0);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::line_down));
  host.set_manages(false);
  execute(5, 0);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_role));
  host.set_manages(true);
  host.set_usable(true);
  parts.manager.stop(parts.now);
  execute(5, 0);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_state));
}

TEST_F(ConfigureServiceTest, OneAtATimeAndEachEndsOnce) {
  execute(5, 1);
  EXPECT_TRUE(service.active());
  execute(5, 1);
  EXPECT_EQ(host.answer(2), to_error(Refusal::busy));
  service.end(Refusal::wrong_role, parts.now);
  EXPECT_EQ(host.answer(1), to_error(Refusal::wrong_role));
  service.end(Refusal::wrong_role, parts.now);
  execute(5, 1);
  EXPECT_FALSE(host.answer(3)) << "the one before has ended";
}

TEST_F(ConfigureServiceTest, ProgressIsReportedEachSecondUntilItsTimeIsOver) {
  execute(5, 1, milliseconds(2500));
  std::size_t progress = 0;
  for (const Duration passed : {seconds(1), seconds(2)}) {
    EXPECT_EQ(service.next_wake(), parts.now + passed);
    service.advance(parts.now + passed);
    std::array<Event, 16> events;
    for (const Event& event : std::span(events).first(parts.events.take(events))) {
      progress += event.kind == EventKind::command_progress ? 1U : 0U;
    }
  }
  EXPECT_EQ(progress, 2U);
  EXPECT_EQ(service.next_wake(), parts.now + milliseconds(2500));
  service.advance(parts.now + milliseconds(2500));
  EXPECT_EQ(host.answer(1), to_error(Refusal::timed_out));
  EXPECT_EQ(service.next_wake(), kNever);
}

}  // namespace
}  // namespace linegate::line
