// SPDX-License-Identifier: Apache-2.0
// Every file of tests/plant/scenarios is a test. Other tests have scenarios with errors.
#include "tests/plant/scenario.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "tests/paths.h"

namespace linegate::plant {
namespace {

std::vector<std::filesystem::path> scenario_files() {
  std::vector<std::filesystem::path> out;
  for (const auto& file : std::filesystem::directory_iterator(paths::kScenarios)) {
    if (file.path().extension() == ".plant") {
      out.push_back(file.path());
    }
  }
  std::ranges::sort(out);
  return out;
}

class ScenarioFile : public testing::TestWithParam<std::filesystem::path> {};

TEST_P(ScenarioFile, Holds) {
  std::ifstream in(GetParam());
  std::ostringstream text;
  text << in.rdbuf();
  const Outcome outcome = run_scenario(GetParam().filename().string(), text.str(), 1);
  EXPECT_TRUE(outcome.ok()) << outcome.failure << "\nlast events:\n" << outcome.history;
  EXPECT_GT(outcome.expectations, 0U) << "a scenario without expectations cannot fail";
}

INSTANTIATE_TEST_SUITE_P(Scenarios, ScenarioFile, testing::ValuesIn(scenario_files()),
                         [](const auto& param) {
                           std::string name = param.param.stem().string();
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

TEST(Scenario, AnExpectationThatDoesNotComeTrueFailsWithItsLine) {
  EXPECT_EQ(
      run_scenario("x", "line a\ndevice 1 encoder\nat 1s\nexpect heartbeat-lost within 1s\n", 1)
          .failure,
      "x:4: it did not happen");
  EXPECT_EQ(
      run_scenario(
          "x", "line a\ndevice 1 encoder\nat 1s nmt stop 127\nexpect no own-state within 1s\n", 1)
          .failure,
      "x:4: it happened");
}

TEST(Scenario, ABadStatementIsNamed) {
  const auto failure = [](std::string_view text) { return run_scenario("x", text, 1).failure; };
  EXPECT_EQ(failure("line a\nlien b\n"), "x:2: unknown statement 'lien'");
  EXPECT_EQ(failure("line a\nat 5 minutes\n"), "x:2: '5' is not a time: 100us, 10ms, 2s");
  EXPECT_EQ(failure("line a\nat 1s node 5 dies\n"), "x:2: there is no device 5");
  EXPECT_EQ(failure("line a\nat 1s\nexpect flood\n"), "x:3: unknown event 'flood'");
  EXPECT_EQ(failure("line a\ndevice 5 toaster\n"), "x:2: no device profile 'toaster'");
}

}  // namespace
}  // namespace linegate::plant
