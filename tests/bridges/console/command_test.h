// SPDX-License-Identifier: Apache-2.0
// A command of the console, and the simulated gateway that it is sent to.
#pragma once

#include <chrono>
#include <cstddef>
#include <initializer_list>
#include <sstream>
#include <vector>

#include <gtest/gtest.h>

#include "bridges/console/commands.h"

namespace linegate::console::test {

inline std::vector<std::byte> raw(std::initializer_list<unsigned> values) {
  std::vector<std::byte> out;
  for (const unsigned value : values) {
    out.push_back(static_cast<std::byte>(value));
  }
  return out;
}

// The request of the command, which is of that kind; otherwise the test fails.
template <class Request>
const Request& as(const line::Command& command) {
  return std::get<Request>(command.request);
}

// Gateway is a Client. The command has context_, and prints to out_ and err_.
template <class Gateway>
class CommandTest : public testing::Test {
 protected:
  Gateway gateway_;
  std::ostringstream out_;
  std::ostringstream err_;
  Context context_{.client = gateway_,
                   .out = out_,
                   .err = err_,
                   .wait = std::chrono::milliseconds(1),
                   .timeout = std::chrono::seconds(1)};
};

}  // namespace linegate::console::test
