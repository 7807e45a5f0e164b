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
  void execute(Configure request, Duration timeout = {}) {
    service.execute({.tag = ++tag, .timeout = timeout, .request = request}, parts.now);
  }

  ManagerParts parts;
  RecordingHost host;
  manager::Configurator configurator{parts.dictionary, node_plans(parts.config), parts.sdo,
                                     parts.events, kSdoTimeout};
  ConfigureService service{host, parts.manager, configurator, parts.events};
  std::uint64_t tag = 0;
};

TEST_F(ConfigureServiceTest, IsRefusedWhereItMakesNoSense) {
  execute({.node = 6});
  EXPECT_EQ(host.answer(tag), to_error(Refusal::bad_request));
  host.set_usable(false);
  execute({.node = 5});
  EXPECT_EQ(host.answer(tag), to_error(Refusal::line_down));
  host.set_manages(false);
  execute({.node = 5});
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_role));
  host.set_manages(true);
  host.set_usable(true);
  parts.manager.stop(parts.now);
  execute({.node = 5});
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_state));
}

TEST_F(ConfigureServiceTest, OneAtATimeAndEachEndsOnce) {
  execute({.node = 5, .apply = true});
  EXPECT_TRUE(service.active());
  execute({.node = 5, .apply = true});
  EXPECT_EQ(host.answer(2), to_error(Refusal::busy));
  service.end(Refusal::wrong_role, parts.now);
  EXPECT_EQ(host.answer(1), to_error(Refusal::wrong_role));
  service.end(Refusal::wrong_role, parts.now);
  execute({.node = 5, .apply = true});
  EXPECT_FALSE(host.answer(3)) << "the one before has ended";
}

TEST_F(ConfigureServiceTest, ProgressIsReportedEachSecondUntilItsTimeIsOver) {
  execute({.node = 5, .apply = true}, milliseconds(2500));
  std::size_t progress = 0;
  for (const Duration passed : {seconds(1), seconds(2)}) {
    EXPECT_EQ(service.next_wake(), parts.now + passed);
    service.advance(parts.now + passed);
    std::array<Event, 16> events;
    for (const Event& event : std::span(events).first(parts.events.take(events))) {
      progress += event.kind() == EventKind::command_progress ? 1U : 0U;
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
