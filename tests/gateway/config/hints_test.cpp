// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/hints.h"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/paths.h"

namespace linegate::config {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> hints_of(const std::string& line) {
  auto loaded = read("schema: 1\nlines:\n  - {name: press, interface: 'virtual:p', " + line + "}\n",
                     paths::in_repository("plant.yaml"));
  EXPECT_TRUE(loaded.ok());
  add_hints(loaded);
  std::vector<std::string> out;
  for (const Diagnostic& each : loaded.diagnostics) {
    out.push_back(to_string(each));
  }
  return out;
}

TEST(Hints, PdosOnASyncOfNobody) {
  const std::string nodes =
      "nodes: [{id: 5, name: ram, eds: bridges/sim/eds/drive.eds, heartbeat: 200ms}]";
  EXPECT_THAT(hints_of(nodes), ElementsAre("press: warning: TPDO 2 of ram, RPDO 2 of ram: on SYNC, "
                                           "but no node produces SYNC (sync of the line)"));
  EXPECT_THAT(hints_of("sync: 10ms, " + nodes), IsEmpty());
}

TEST(Hints, NodesWithoutErrorControl) {
  const std::string node = "nodes: [{id: 5, name: n, eds: bridges/sim/eds/digital-io.eds";
  EXPECT_THAT(
      hints_of(node + "}]"),
      ElementsAre("press: warning: node 5 (n): has neither heartbeat nor guarding: its loss "
                  "is not detected"));
  EXPECT_THAT(hints_of(node + ", heartbeat: 100ms}]"), IsEmpty());
  EXPECT_THAT(hints_of(node + ", heartbeat: {consumer: 100ms}}]"), IsEmpty());
  EXPECT_THAT(hints_of(node + ", guarding: {time: 100ms, factor: 3}}]"), IsEmpty());
  for (const std::string role : {"role: observer, ", "role: device, "}) {
    EXPECT_THAT(hints_of(role + node + "}]"),
                ElementsAre(HasSubstr("has neither heartbeat nor guarding")))
        << role;
    EXPECT_THAT(hints_of(role + node + ", heartbeat: {consumer: 100ms}}]"), IsEmpty()) << role;
  }
}

TEST(Hints, AFlyingMasterWithoutHeartbeat) {
  const std::string node =
      ", nodes: [{id: 5, name: n, eds: bridges/sim/eds/digital-io.eds, heartbeat: 100ms}]";
  EXPECT_THAT(hints_of("flying_master: {priority: 1}" + node),
              ElementsAre(HasSubstr("flying_master without heartbeat of the line")));
  EXPECT_THAT(hints_of("flying_master: {priority: 1}, heartbeat: 200ms" + node), IsEmpty());
}

TEST(Hints, AVendorIdOfNobody) {
  const std::string folder = testing::TempDir() + "/linegate-hints";
  std::filesystem::create_directories(folder);
  const auto hints = [&](const std::string& product) {
    std::ofstream(folder + "/x.eds")
        << "[FileInfo]\n[DeviceInfo]\nVendorNumber=0\n[MandatoryObjects]\nSupportedObjects=2\n"
           "1=0x1000\n2=0x1018\n[1000]\nParameterName=t\nDataType=7\nAccessType=ro\n[1018]\n"
           "ParameterName=i\nObjectType=9\n[1018sub0]\nParameterName=n\nDataType=5\n"
           "AccessType=ro\nDefaultValue=2\n[1018sub1]\nParameterName=v\nDataType=7\n"
           "AccessType=ro\nDefaultValue=0\n[1018sub2]\nParameterName=p\nDataType=7\n"
           "AccessType=ro\nDefaultValue=" +
               product + "\n";
    auto loaded = read(
        "schema: 1\nlines:\n  - {name: press, interface: 'virtual:p', nodes: [{id: 5, name: n, "
        "eds: x.eds, heartbeat: 100ms}]}\n",
        folder + "/plant.yaml");
    EXPECT_TRUE(loaded.ok());
    loaded.diagnostics.clear();
    add_hints(loaded);
    return loaded.diagnostics.empty() ? "" : loaded.diagnostics.back().text;
  };
  EXPECT_THAT(hints("17"), HasSubstr("vendor-ID 0: LSS and scan identify it by product code"));
  EXPECT_THAT(hints("0"), HasSubstr("LSS and scan cannot identify it"));
  std::filesystem::remove_all(folder);
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
      << "an observer writes nothing";
  EXPECT_THAT(hints_of(node + "drive.eds, heartbeat: 200ms}]"), IsEmpty());
}

}  // namespace
}  // namespace linegate::config
