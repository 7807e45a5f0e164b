#include "gateway/hints.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace linegate::gateway {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::vector<std::string> hints_of(const std::string& line) {
  auto loaded =
      config::read("schema: 1\nlines:\n  - {name: press, interface: 'virtual:p', " + line + "}\n",
                   LINEGATE_SOURCE_DIR "/plant.yaml");
  EXPECT_TRUE(loaded.ok());
  add_hints(loaded);
  std::vector<std::string> out;
  for (const Diagnostic& each : loaded.diagnostics) {
    out.push_back(to_string(each));
  }
  return out;
}

TEST(Hints, PdosOnASyncOfNobody) {
  const std::string nodes = "nodes: [{id: 5, name: ram, eds: bridges/sim/eds/drive.eds}]";
  EXPECT_THAT(hints_of(nodes), ElementsAre("press: warning: TPDO 2 of ram, RPDO 2 of ram: on SYNC, "
                                           "which nobody produces (sync of the line)"));
  EXPECT_THAT(hints_of("sync: 10ms, " + nodes), IsEmpty());
}

TEST(Hints, ErrorControlThatTheDeviceFileDoesNotKnow) {
  const std::string node = "sync: 10ms, nodes: [{id: 5, name: n, eds: bridges/sim/eds/";
  const std::string guarding = ".eds, guarding: {time: 100ms, factor: 3}}]";
  EXPECT_THAT(hints_of(node + "drive" + guarding),
              ElementsAre("press: warning: node 5 (n): its file has no object 100C:00, which its "
                          "error control is written to"));
  EXPECT_THAT(hints_of(node + "digital-io" + guarding), IsEmpty());
  EXPECT_THAT(
      hints_of("role: observer, nodes: [{id: 5, name: n, eds: bridges/sim/eds/drive" + guarding),
      IsEmpty())
      << "which writes nothing";
  EXPECT_THAT(hints_of(node + "drive.eds, heartbeat: 200ms}]"), IsEmpty());
}

}  // namespace
}  // namespace linegate::gateway
