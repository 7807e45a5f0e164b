// SPDX-License-Identifier: Apache-2.0
// Reduces a failing random plant to the smallest one that still fails.
#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/plant/generator.h"
#include "tests/plant/scenario.h"

namespace linegate::plant {
namespace {

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> out;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    out.push_back(line);
  }
  return out;
}

std::string join(const std::vector<std::string>& lines) {
  std::string out;
  for (const std::string& line : lines) {
    out += line + '\n';
  }
  return out;
}

// Equal except for numbers: with fewer statements the counts and times change.
bool similar(std::string a, std::string b) {
  const auto is_digit = [](unsigned char c) { return c >= '0' && c <= '9'; };
  std::erase_if(a, is_digit);
  std::erase_if(b, is_digit);
  return !a.empty() && a == b;
}

// Whether the device is switched on, and its cable plugged, after these statements.
std::pair<bool, bool> presence_of(const std::string& node, const std::vector<std::string>& lines) {
  bool is_on = true;
  bool is_plugged = true;
  for (const std::string& line : lines) {
    const auto has = [&](const char* what) { return line.ends_with(" node " + node + what); };
    is_on = (is_on || has(" returns")) && !has(" dies");
    is_plugged = (is_plugged || has(" plugged")) && !has(" unplugged");
  }
  return {is_on, is_plugged};
}

// Whether each device that the statement names by its node-ID is still among the lines, and at
// their end as present as before: otherwise an expectation would fail for another reason.
bool has_devices_of(const std::vector<std::string>& lines, const std::string& statement,
                    const std::vector<std::string>& before) {
  return std::ranges::all_of(before, [&](const std::string& line) {
    std::istringstream words(line);
    std::string verb;
    std::string node;
    words >> verb >> node;
    const bool is_named =
        verb == "device" && (" " + statement + " ").find(" " + node + " ") != std::string::npos;
    return !is_named || (std::ranges::find(lines, line) != lines.end() &&
                         presence_of(node, lines) == presence_of(node, before));
  });
}

}  // namespace

std::string shrink(const std::string& text, unsigned long seed) {
  // A statement is removed only if the rest still fails for the same reason, and not because a
  // necessary statement is missing.
  struct Failure {
    std::string statement;
    std::string reason;
  };
  const auto run = [seed](const std::vector<std::string>& lines) {
    const std::string failure = run_scenario("shrunken", join(lines), seed).failure;
    const std::size_t place = failure.find(": ");
    if (place == std::string::npos) {
      return Failure{{}, failure};
    }
    const unsigned long line = std::strtoul(failure.c_str() + failure.find(':') + 1, nullptr, 10);
    return Failure{line - 1 < lines.size() ? lines[line - 1] : std::string(),
                   failure.substr(place + 2)};
  };
  // An expectation must fail at the same statement; an oracle may fail at any statement.
  const Failure wanted = run(lines_of(text));
  const bool is_expectation = wanted.statement.starts_with("expect");
  const auto fails = [&](const std::vector<std::string>& lines) {
    if (is_expectation && !has_devices_of(lines, wanted.statement, lines_of(text))) {
      return false;
    }
    const Failure failure = run(lines);
    return similar(failure.reason, wanted.reason) &&
           (!is_expectation || failure.statement == wanted.statement);
  };
  std::vector<std::string> lines = lines_of(text);
  bool shorter = true;
  while (shorter) {
    shorter = false;
    for (std::size_t i = lines.size(); i-- > 0;) {
      std::vector<std::string> fewer = lines;
      fewer.erase(fewer.begin() + static_cast<long>(i));
      if (fails(fewer)) {
        lines = std::move(fewer);
        shorter = true;
      }
    }
  }
  return join(lines);
}

}  // namespace linegate::plant
