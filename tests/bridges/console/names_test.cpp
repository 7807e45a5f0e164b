// SPDX-License-Identifier: Apache-2.0
// `linegate names`, whose output a shell uses for completion.
#include "bridges/console/names.h"

#include <string>

#include <gtest/gtest.h>

#include "tests/bridges/console/command_test.h"

namespace linegate::console {
namespace {

constexpr const char* kCommand = "$(touch x)";

// A plant with node 5 (ram) and node 6, whose name is not permitted in plant.yaml, and lines of an
// unknown gateway.
class GatewayAndStranger : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    LineView view;
    view.state.nodes_configured = 2;
    const LineId press{"plant", "press"};
    listener.on_line(press, view);
    listener.on_node(press, {.name = "ram", .state = {.node = 5, .configured = true}});
    listener.on_node(press, {.name = kCommand, .state = {.node = 6, .configured = true}});
    view.state.nodes_configured = 0;
    for (const char* const line : {kCommand, "`reboot`", "a b", "*", "\x1b[2J", ""}) {
      listener.on_line({"plant", line}, view);
    }
    listener.on_line({kCommand, "hall"}, view);
  }
  Answer call(const LineId& /*id*/, const line::Command& /*command*/, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    return {};
  }
};

using NamesCommand = test::CommandTest<GatewayAndStranger>;

TEST_F(NamesCommand, PrintsNoNameThatAShellExpands) {
  EXPECT_EQ(names(context_), kDone);
  EXPECT_EQ(out_.str(), "press\npress:own\npress:all\npress:ram\npress:6\n");
}

}  // namespace
}  // namespace linegate::console
