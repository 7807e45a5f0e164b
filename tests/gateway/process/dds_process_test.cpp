// SPDX-License-Identifier: Apache-2.0
// DDS in a process of its own that dies, stops and is started again, while a subscriber of another
// process watches: here the gateway is in the process of the test, and the DDS endpoints are not.
#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include "tests/gateway/process/dds_process_fixture.h"
#include "tests/paths.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;

// A datagram may end each process before it has created its endpoints, as this program ends.
TEST(DdsProcess, LinesStartWhileEachProcessDiesAtItsStart) {
  config::Plant plant = make_plant(plant_text());
  plant.dds_program = "/bin/false";
  const auto made = Gateway::make(plant, 1);
  ASSERT_TRUE(made.ok());
  EXPECT_TRUE(made.diagnostics.empty());
  (*made.value)->start();
}

TEST_F(DdsProcessTest, HasNoPrivilegesAndLimitedMemory) {
  std::ifstream file("/proc/" + std::to_string(dds_process()) + "/status");
  std::stringstream status;
  status << file.rdbuf();
  for (const char* expected :
       {"NoNewPrivs:\t1", "Seccomp:\t2", "CapEff:\t0000000000000000", "CapPrm:\t0000000000000000",
        "CapInh:\t0000000000000000", "CapAmb:\t0000000000000000"}) {
    EXPECT_NE(status.str().find(expected), std::string::npos) << expected;
  }
  std::ifstream limits("/proc/" + std::to_string(dds_process()) + "/limits");
  std::stringstream text;
  text << limits.rdbuf();
  EXPECT_NE(text.str().find("Max data size             2147483648           2147483648"),
            std::string::npos)
      << text.str();
}

TEST_F(DdsProcessTest, HasOnlyTheDescriptorsThatItNeeds) {
  // Without close-on-exec, so that every process that is started inherits it.
  const int marker = memfd_create("marker", 0);
  ASSERT_GE(marker, 0);
  const pid_t first = dds_process();
  kill(first, SIGKILL);
  ASSERT_TRUE(back_after(first));
  pid_t next = 0;  // has its name only after exec()
  ASSERT_TRUE(meanwhile([&] { return (next = dds_process()) != 0; }));
  const auto folder = "/proc/" + std::to_string(next) + "/fd";
  int descriptors = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::error_code gone;
    const std::string target = std::filesystem::read_symlink(entry.path(), gone).string();
    EXPECT_EQ(target.find("memfd"), std::string::npos) << target;
    ++descriptors;
  }
  EXPECT_GT(descriptors, 3);
  close(marker);
}

TEST_F(DdsProcessTest, ASubscriberThatStartsAfterARestartReceivesEverything) {
  const pid_t first = dds_process();
  kill(first, SIGKILL);
  ASSERT_TRUE(back_after(first));
  dds::ClientOptions options;
  options.domain = test::own_domain();
  options.profile_file = paths::kLoopbackProfiles;
  auto late = dds::Client::make(options);
  ASSERT_TRUE(late.ok());
  GatewayListener seen;
  const Instant give_up = monotonic_now() + kPatience;
  const auto complete = [&] {
    return seen.layouts.size() == 4 && seen.lines.size() == 2 && seen.nodes.size() >= 2 &&
           seen.output_states.contains("open") && seen.images.contains("open/outputs") &&
           !seen.events["open"].empty() && seen.events["open"].begin()->first == 1 &&
           !seen.events[""].empty();
  };
  while (!complete() && monotonic_now() < give_up) {
    (*late.value)->poll(20ms, seen);
  }
  EXPECT_TRUE(complete());
  EXPECT_EQ(seen.incarnation, kIncarnation);
  EXPECT_EQ(seen.gaps, 0);
}

TEST_F(DdsProcessTest, AStoppedProcessIsReplaced) {
  const pid_t first = dds_process();
  kill(first, SIGSTOP);
  EXPECT_TRUE(back_after(first));
  EXPECT_TRUE(read().reply.ok());
  EXPECT_LE(strict_.lost_images, kImages);
}

TEST_F(DdsProcessTest, AnEndIsAnEventOfTheGatewayWithItsReason) {
  const pid_t first = dds_process();
  kill(first, SIGABRT);
  const auto end = reported_end();
  EXPECT_EQ(end.cause, event::ProcessEnd::signal);
  EXPECT_EQ(end.detail, static_cast<std::uint32_t>(SIGABRT));
  EXPECT_EQ(end.ends, 1U);
  const auto is_text = [](const std::string& text) {
    return text.starts_with("the DDS process was ended by signal 6 (Aborted); it is started again");
  };
  EXPECT_TRUE(std::any_of(strict_.texts.begin(), strict_.texts.end(), is_text));
  EXPECT_EQ(strict_.missing_events(""), 0U);
}

TEST_F(DdsProcessTest, AnAbortedProcessIsReplaced) {
  expect_replacement(SIGABRT, event::ProcessEnd::signal);
}

TEST_F(DdsProcessTest, AKilledProcessIsReplaced) {
  expect_replacement(SIGKILL, event::ProcessEnd::signal);
}

TEST_F(DdsProcessTest, AStoppedProcessIsReportedAsOneThatDidNotRespond) {
  expect_replacement(SIGSTOP, event::ProcessEnd::no_response);
}

TEST_F(DdsFaultsTest, AProcessThatUsesUpItsMemoryIsReplaced) {
  expect_replacement(SIGUSR2, event::ProcessEnd::memory, false);
}

TEST_F(DdsFaultsTest, AnEndlessLoopInTheThreadThatServesTheGatewayIsFound) {
  expect_replacement(SIGRTMIN, event::ProcessEnd::no_response);
}

// The threads that serve the gateway continue meanwhile.
TEST_F(DdsFaultsTest, AnEndlessLoopForADatagramIsFound) {
  expect_replacement(SIGUSR1, event::ProcessEnd::no_response);
}

// The threads that serve the gateway and receive datagrams continue meanwhile.
TEST_F(DdsFaultsTest, AnEndlessLoopInATimerIsFound) {
  expect_replacement(SIGRTMIN + 1, event::ProcessEnd::no_response);
}

TEST_F(DdsFaultsTest, AProcessThatReportsImagesThatDoNotExistIsReplaced) {
  expect_replacement(SIGRTMIN + 2, event::ProcessEnd::malformed);
}

TEST_F(DdsProcessTest, AnAnswerThatWasLostWithItsProcessIsSentAgain) {
  const auto commands = [&] { return strict_.lines["open"].counters.commands; };
  ASSERT_TRUE(meanwhile([&] { return strict_.lines.contains("open"); }));
  ASSERT_TRUE(read().reply.ok());
  ASSERT_TRUE(meanwhile([&] { return commands() > 0; }));
  const auto before = commands();
  const pid_t first = dds_process();
  client_->send(at("open"), sdo_read(5, 0x1000, 0), 30s);
  pass(1ms);
  kill(first, SIGKILL);
  ASSERT_TRUE(meanwhile([&] { return strict_.replies.size() == 1; }));
  EXPECT_EQ(strict_.replies.front(), Error{});
  ASSERT_TRUE(back_after(first));
  ASSERT_TRUE(meanwhile([&] { return commands() > before; }));
  pass(1500ms);
  EXPECT_EQ(commands(), before + 1);
}

TEST_F(DdsProcessTest, OutputsReactToTheirWatchdogWhileNoProcessRuns) {
  ASSERT_TRUE(meanwhile([&] { return strict_.layouts.contains("open/outputs"); }));
  const image::Layout layout = strict_.layouts["open/outputs"];
  ASSERT_FALSE(layout.entries.empty());
  line::OutputWrite write{.group = 3,
                          .layout_id = layout.id,
                          .arming = 1,
                          .watchdog = 300ms,
                          .reactions = line::kZeroOutputs};
  write.values = {{.entry = 0, .length = 1, .data = {std::byte{0x5A}}}};
  ASSERT_TRUE(meanwhile([&] { return client_->output_peers() > 0; }));
  ASSERT_TRUE(meanwhile([&] {
    client_->write_outputs(at("open"), write);
    return strict_.output_states["open"].applied > 3;
  }));
  const pid_t first = dds_process();
  kill(first, SIGSTOP);  // for longer than the watchdog: it is found after 1.5 s
  ASSERT_TRUE(back_after(first));
  ASSERT_TRUE(meanwhile([&] { return strict_.output_states["open"].arming_wanted; }));
  // An old set-point has no effect; a new arming number has.
  const auto applied = strict_.output_states["open"].applied;
  client_->write_outputs(at("open"), write);
  ASSERT_TRUE(meanwhile([&] { return strict_.output_states["open"].refused > 0; }));
  EXPECT_EQ(strict_.output_states["open"].applied, applied);
  write.arming = 2;
  ASSERT_TRUE(meanwhile([&] {
    client_->write_outputs(at("open"), write);
    return strict_.output_states["open"].applied > applied;
  }));
}

TEST_F(DdsProcessTest, SurvivesReloadsBetweenAndAfterRestarts) {
  const std::string more = "  - {name: more, interface: \"virtual:more\", access: all}\n";
  const pid_t first = dds_process();
  ASSERT_TRUE(gateway_->reload(make_plant(plant_text() + more)).done);
  ASSERT_TRUE(meanwhile([&] { return strict_.lines.contains("more"); }));
  kill(first, SIGKILL);
  ASSERT_TRUE(gateway_->reload(make_plant(plant_text())).done);
  ASSERT_TRUE(back_after(first));
  ASSERT_TRUE(gateway_->reload(make_plant(plant_text() + more)).done);
  strict_.lines.erase("more");
  ASSERT_TRUE(meanwhile([&] { return strict_.lines.contains("more"); }));
  EXPECT_EQ(strict_.missing_events("more"), 0U);
  EXPECT_TRUE(read().reply.ok());
}

// LINEGATE_KILLS: number of deaths; LINEGATE_SEED: of the times between them.
TEST_F(DdsProcessTest, LosesNothingByDeathsAtRandomTimes) {
  const char* const number = std::getenv("LINEGATE_KILLS");
  const char* const chosen = std::getenv("LINEGATE_SEED");
  const int kills = number == nullptr ? 20 : std::atoi(number);
  const std::uint64_t seed = chosen == nullptr ? std::random_device()() : std::stoull(chosen);
  std::cout << kills << " deaths, LINEGATE_SEED=" << seed << '\n';
  std::mt19937_64 random(seed);
  const auto heartbeats_lost = [&] { return strict_.lines["open"].counters.heartbeats_lost; };
  ASSERT_TRUE(meanwhile([&] { return strict_.lines.contains("open"); }));
  const auto before = heartbeats_lost();
  const auto commands_before = strict_.lines["open"].counters.commands;
  int answered = 0;
  for (int i = 0; i < kills; ++i) {
    pass(std::chrono::milliseconds(random() % 400));
    const pid_t present = dds_process();
    const int signal = std::array{SIGKILL, SIGABRT, SIGSEGV,
                                  SIGSTOP}[random() % 8 == 0 ? 3U : static_cast<unsigned>(i) % 3U];
    kill(present, signal);
    if (i % 5 == 0) {
      ASSERT_TRUE(read().reply.ok()) << i;
      ++answered;
    }
    ASSERT_TRUE(back_after(present)) << "death " << i << " by signal " << signal;
  }
  EXPECT_LE(strict_.lost_images, kills * kImages);
  EXPECT_EQ(strict_.missing_events("open"), 0U);
  EXPECT_EQ(strict_.missing_events(""), 0U);
  EXPECT_EQ(strict_.changed_events, 0);
  EXPECT_EQ(strict_.incarnations, std::set<std::uint64_t>{kIncarnation});
  const auto commands = commands_before + static_cast<std::uint64_t>(answered);
  EXPECT_TRUE(meanwhile([&] { return strict_.lines["open"].counters.commands >= commands; }));
  EXPECT_EQ(strict_.lines["open"].counters.commands, commands) << "a command was carried out twice";
  EXPECT_EQ(heartbeats_lost(), before);
}

}  // namespace
}  // namespace linegate::gateway
