// SPDX-License-Identifier: Apache-2.0
// Shared by the tests of this folder: clients, raw endpoints, and waiting with a deadline.
#pragma once

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "bridges/dds/client.h"

#include "tests/dds/known_values.h"
#include "tests/dds/peer_process.h"
#include "tests/paths.h"

namespace linegate::test {

// Long enough for a loaded machine. A test that passes does not wait that long.
inline constexpr std::chrono::seconds kDeadline{20};
// Fast DDS 2.9.1 does not authenticate every participant that joins late: a new one is made.
inline constexpr int kAttempts = 8;
inline constexpr std::chrono::seconds kOneAttempt{6};

// Repeats `step` until it returns true. Returns false after the deadline.
inline bool eventually(const std::function<bool()>& step,
                       std::chrono::nanoseconds deadline = kDeadline) {
  const auto end = std::chrono::steady_clock::now() + deadline;
  while (!step()) {
    if (std::chrono::steady_clock::now() > end)
      return false;
  }
  return true;
}

inline dds::ClientOptions client_options(const std::string& name = "") {
  dds::ClientOptions options;
  options.name = name;
  options.domain = domain();
  options.profile_file = paths::kLoopbackProfiles;
  return options;
}

inline std::unique_ptr<dds::Client> make_client(const dds::ClientOptions& options) {
  auto made = dds::Client::make(options);
  for (const Diagnostic& diagnostic : made.diagnostics) {
    ADD_FAILURE() << to_string(diagnostic);
  }
  return made.ok() ? std::move(*made.value) : nullptr;
}

// A file for one test, removed at the end of the test.
struct File {
  explicit File(const std::string& text) { std::ofstream(path) << text; }
  ~File() { std::filesystem::remove(path); }
  const std::string path = testing::TempDir() + "profiles-" + std::to_string(::getpid()) + ".xml";
};

inline dds::Target known_line() {
  return {known::kGateway, known::kLine, 0};
}

}  // namespace linegate::test
