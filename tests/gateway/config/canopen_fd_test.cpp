// SPDX-License-Identifier: Apache-2.0
// Lines of CANopen FD beside others: what crosses from one to the other, and what does not.
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridges/sim/device.h"
#include "gateway/config/plant.h"

#include "tests/paths.h"

namespace linegate::config {
namespace {

using testing::HasSubstr;
using testing::Not;

std::string fd_findings(const Loaded<Plant>& loaded) {
  std::string out;
  for (const Diagnostic& diagnostic : loaded.diagnostics) {
    out += to_string(diagnostic) + '\n';
  }
  return out;
}

Loaded<Plant> read_fd(const std::string& text) {
  return read("schema: 1\n" + text, paths::in_repository("plant.yaml"));
}

// Replaces the first `from` after that section begins.
void replace_in(std::string& text, std::string_view section, std::string_view from,
                std::string_view to) {
  const std::size_t begin = text.find('[' + std::string(section) + ']');
  ASSERT_NE(begin, std::string::npos) << section;
  const std::size_t at = text.find(from, begin);
  ASSERT_NE(at, std::string::npos) << section;
  text.replace(at, from.size(), to);
}

// fd-io, whose first input and output are strings of 16 bytes, or of these bits in hexadecimal
// digits, alone in their PDOs.
std::string file_of_long_values(const std::string& bits = "80",
                                const std::string& name = "/long-values.eds") {
  std::string text(sim::eds_text("fd-io"));
  for (const auto& [mapping, object, entry] :
       {std::tuple{"1600", "6200", "0x620001"}, std::tuple{"1A00", "6000", "0x600001"}}) {
    replace_in(text, mapping + std::string("sub0"), "=64", "=1");
    replace_in(text, mapping + std::string("sub1"), entry + std::string("08"), entry + bits);
    replace_in(text, object + std::string("sub1"), "DataType=0x0005", "DataType=0x0009");
  }
  const std::string path = testing::TempDir() + name;
  std::ofstream(path) << text;
  return path;
}

TEST(CanopenFd, LongValuesAreForwardedToOnesOfTheSameLength) {
  const std::string file = file_of_long_values();
  const std::string shorter = file_of_long_values("50", "/shorter-values.eds");
  const auto plant = [&](const std::string& target, const std::string& forward) {
    return read_fd(
        "lines:\n"
        "  - {name: a, interface: 'virtual:a', canopen_fd: true, nodes: [{id: 5, name: io, eds: " +
        file +
        "}]}\n"
        "  - {name: b, interface: 'virtual:b', canopen_fd: true, nodes: [{id: 5, name: io, eds: " +
        target + "}]}\n" + forward);
  };
  const auto local = plant(file, "forward: ['a.io.6000:1 -> b.io.6200:1']\n");
  ASSERT_TRUE(local.ok()) << fd_findings(local);
  ASSERT_EQ(local.value->bindings.size(), 1U);
  EXPECT_EQ(local.value->bindings[0].bits, 128U);
  EXPECT_FALSE(local.value->bindings[0].object) << "B000h has no array of such values";
  const auto remote = plant(file, "forward: ['gw/c.io.6000:1 -> b.io.6200:1']\n");
  EXPECT_TRUE(remote.ok()) << fd_findings(remote);
  EXPECT_THAT(fd_findings(plant(shorter, "forward: ['a.io.6000:1 -> b.io.6200:1']\n")),
              HasSubstr("is VISIBLE_STRING of 16 bytes, \"io.Write output 8-bit.Output byte 1\" is "
                        "VISIBLE_STRING of 10 bytes"));
  std::filesystem::remove(file);
  std::filesystem::remove(shorter);
}

// A PDO of 64 bytes has no place in one of a classical line.
TEST(CanopenFd, AReceivedPdoFeedsSeveralOfAClassicalLine) {
  const auto plant = [](const std::string& fd, const std::string& profile) {
    const std::string io = ", eds: bridges/sim/eds/" + profile + ".eds}";
    const std::string classical = ", eds: bridges/sim/eds/digital-io.eds}";
    return read_fd("lines:\n  - {name: a, interface: 'virtual:a', canopen_fd: " + fd +
                   ", nodes: [{id: 5, name: io" + io +
                   "]}\n  - {name: b, interface: 'virtual:b', nodes: [{id: 6, name: x" + classical +
                   ", {id: 7, name: y" + classical +
                   "]}\nforward: ['a.io.6000:1 -> b.x.6200:1', 'a.io.6000:2 -> b.y.6200:1']\n");
  };
  EXPECT_EQ(fd_findings(plant("true", "fd-io")), "");
  EXPECT_THAT(fd_findings(plant("false", "digital-io")),
              HasSubstr("one received PDO feeds at most one PDO of another line"));
}

TEST(CanopenFd, LongValuesHaveNoDefault) {
  const std::string file = file_of_long_values();
  EXPECT_THAT(fd_findings(read_fd(
                  "lines: [{name: a, interface: 'virtual:a', canopen_fd: true, outputs: {defaults: "
                  "{'io.6200:1': ABCD}}, nodes: [{id: 5, name: io, eds: " +
                  file + "}]}]\n")),
              HasSubstr("has 128 bits: a default has up to 64"));
  std::filesystem::remove(file);
}

constexpr const char* kFdBesideOthers = R"(lines:
  - {name: slow, interface: 'virtual:a', enter: all}
  - name: fast
    interface: 'virtual:b'
    canopen_fd: true
    enter: {from: all, services: [sdo, emcy]}
    emcy_to: slow
    gateways: [7]
)";

TEST(CanopenFd, ALineTakesPartInRouting) {
  const auto loaded = read_fd(std::string("routes: [{to: 9, via: 'slow:5'}]\n") + kFdBesideOthers);
  ASSERT_TRUE(loaded.ok()) << fd_findings(loaded);
  for (const LinePlan& line : loaded.value->lines) {
    const routing::Config& config = line.config.routing;
    EXPECT_EQ(config.interfaces.size(), 2U);
    EXPECT_EQ(config.interface, line.config.network_id);
    EXPECT_EQ(config.routes.size(), 3U);
  }
  const routing::Config& fast = loaded.value->lines[1].config.routing;
  ASSERT_EQ(fast.access.size(), 1U);
  EXPECT_TRUE(fast.access[0].sdo_read && fast.access[0].emcy);
  EXPECT_EQ(fast.emcy_networks[5], 1U);
  EXPECT_EQ(fast.gateways, std::vector<std::uint8_t>{7});
}

TEST(CanopenFd, NoNextGatewayIsReachedOverALine) {
  EXPECT_THAT(
      fd_findings(read_fd(std::string("routes: [{to: 9, via: 'fast:5'}]\n") + kFdBesideOthers)),
      HasSubstr("line \"fast\" is one of CANopen FD, which has no network indication: no next "
                "gateway is reached over it"));
}

std::string with_own_pdos(const std::string& pdos, bool fd = true) {
  return fd_findings(
      read_fd(std::string("lines:\n  - name: a\n    interface: 'virtual:a'\n    canopen_fd: ") +
              (fd ? "true" : "false") +
              "\n    own_objects:\n"
              "      '2100:1': {type: u64, map: true}\n"
              "      '2100:2': {type: u64, map: true}\n"
              "      '2100:3': {type: b, map: true}\n"
              "    own_pdos: {tpdo1: {cob_id: 0x1C1, " +
              pdos + "}}\n"));
}

TEST(CanopenFd, OwnPdosAreAsThoseOfNodes) {
  EXPECT_EQ(with_own_pdos("map: ['2100:1', '2100:2']"), "");
  EXPECT_THAT(with_own_pdos("map: ['2100:1', '2100:2']", false),
              HasSubstr("the objects have 128 bits; a PDO has room for 64"));
  EXPECT_THAT(with_own_pdos("map: ['2100:3']"), HasSubstr("2100:03 has 1 bits"));
  EXPECT_THAT(with_own_pdos("rtr: true, map: ['2100:1']"),
              HasSubstr("rtr: CANopen FD has no remote frames"));
  EXPECT_THAT(with_own_pdos("type: 253, map: ['2100:1']"),
              HasSubstr("CANopen FD lacks the transmission type 253"));
  EXPECT_THAT(with_own_pdos("mpdo: destination, map: ['2100:1']"),
              HasSubstr("MPDO is not defined for CANopen FD"));
}

TEST(CanopenFd, KeysThatDoNotFitTogetherAreErrors) {
  const auto with_keys = [](const std::string& keys) {
    return fd_findings(read_fd("lines: [{name: a, interface: 'simulated:', " + keys + "}]\n"));
  };
  EXPECT_THAT(with_keys("usdo_abort: four-bytes"), HasSubstr("usdo_abort needs canopen_fd: true"));
  EXPECT_THAT(with_keys("emcy_fd: true"), HasSubstr("emcy_fd needs canopen_fd: true"));
  EXPECT_THAT(with_keys("canopen_fd: true, bit_rate: 1Mbit, data_bit_rate: 500kbit"),
              HasSubstr("the data phase is not slower than bit_rate"));
  EXPECT_EQ(with_keys("canopen_fd: true, bit_rate: 1Mbit, data_bit_rate: 1Mbit"), "");
  EXPECT_THAT(with_keys("simulate: [{node: 5, profile: fd-io}]"),
              HasSubstr("fd-io is a device of CANopen FD: the line needs canopen_fd: true"));
  EXPECT_THAT(with_keys("canopen_fd: true, simulate: [{node: 5, profile: fd-io}]"),
              Not(HasSubstr("canopen_fd: true")));
  EXPECT_THAT(with_keys("canopen_fd: true, own_values: {'1F80:0': 0}"),
              HasSubstr("the own node refuses the value of object 1F80:00"));
}

}  // namespace
}  // namespace linegate::config
