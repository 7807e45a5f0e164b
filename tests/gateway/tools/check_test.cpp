// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/check.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include "gateway/config/plant.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/tools/json_text.h"

#include "tests/paths.h"

namespace linegate::gateway {
namespace {

const std::string kDemo = paths::in_repository("deploy/plants/demo.yaml");

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Check, SaysWhatWouldBeRun) {
  const auto loaded = config::load(kDemo);
  ASSERT_TRUE(loaded.ok());
  const std::string text = describe(*loaded.value);
  EXPECT_TRUE(contains(text, "gateway demo, DDS domain 0"));
  EXPECT_TRUE(contains(text, "line press on simulated:"));
  EXPECT_TRUE(contains(text, "node 5 ram: Servo drive")) << text;
  EXPECT_TRUE(contains(text, "TPDO2 285h every SYNC: 6064:00/32 \"Position actual value\""));
  EXPECT_TRUE(contains(text, "TPDO2 294h on event, inhibit 20ms, timer 100ms"));
  EXPECT_TRUE(contains(text, "inputs: "));
  EXPECT_TRUE(contains(text, "ram.Statusword"));
  EXPECT_TRUE(contains(text, "output group 1 motion, sent on change: ram.Controlword"));
  EXPECT_TRUE(contains(text, "write 6083:00 = 000007D0h"));
}

// Values that a DCF, XDC or concise DCF configures, without `objects` and `heartbeat`.
TEST(Check, SaysWhatTheDcfOfANodeWrites) {
  auto loaded = config::load(kDemo);
  ASSERT_TRUE(loaded.ok());
  line::NodeConfig& node = loaded.value->lines.front().config.nodes.front();
  node.heartbeat = {};
  node.objects.clear();
  const auto set = [&node](std::uint16_t index, std::vector<std::byte> value, bool configured) {
    for (od::ObjectDescription& object : node.device.objects) {
      if (object.index == index) {
        object.variables.front().value = std::move(value);
        object.variables.front().configured = configured;
        return;
      }
    }
    FAIL() << "no object " << index;
  };
  set(0x1017, {std::byte{0xF4}, std::byte{1}}, true);
  set(0x6083, {std::byte{7}, {}, {}, {}}, true);
  std::string text = describe(*loaded.value);
  EXPECT_TRUE(contains(text, "    heartbeat 500ms by its DCF, consumer off")) << text;
  EXPECT_TRUE(contains(text, "    write 1017:00 = 01F4h, of its DCF\n")) << text;
  EXPECT_TRUE(contains(text, "    write 6083:00 = 00000007h, of its DCF\n")) << text;
  const auto writes = YAML::Load(to_json(loaded))["lines"][0]["nodes"][0]["writes"];
  ASSERT_EQ(writes.size(), 2U);
  EXPECT_EQ(writes[0]["object"].as<std::string>(), "1017:00");
  EXPECT_EQ(writes[0]["data"].as<std::string>(), "F401");
  EXPECT_TRUE(writes[0]["dcf"].as<bool>());

  set(0x1017, {std::byte{0xF4}, std::byte{1}}, false);
  EXPECT_TRUE(
      contains(describe(*loaded.value), "    heartbeat 500ms by its default, consumer off"));
  node.objects = {{{0x1017, 0}, {std::byte{100}, {}}}};
  text = describe(*loaded.value);
  EXPECT_TRUE(contains(text, "    heartbeat 100ms by objects, consumer off")) << text;
  EXPECT_TRUE(contains(text, "    write 1017:00 = 0064h\n")) << text;
  node.objects = {{{0x2000, 0}, std::vector<std::byte>(40)}};
  EXPECT_TRUE(contains(describe(*loaded.value), "    write 2000:00 = 40 bytes\n"));
}

// As `linegate dcf` and `sdo read` print them, in the order of their octets on the bus.
TEST(Check, PrintsValuesByTheirDataType) {
  auto loaded = config::load(kDemo);
  ASSERT_TRUE(loaded.ok());
  line::NodeConfig& node = loaded.value->lines.front().config.nodes.front();
  const auto printed = [&](od::DataType type, std::vector<std::byte> value) {
    for (od::ObjectDescription& object : node.device.objects) {
      if (object.index == 0x6083) {
        object.variables.front().type = type;
      }
    }
    node.objects = {line::ObjectValue{{0x6083, 0}, std::move(value)}};
    const std::string text = describe(*loaded.value);
    const std::string begin = "    write 6083:00 = ";
    const std::size_t at = text.find(begin);
    return at == std::string::npos
               ? text
               : text.substr(at + begin.size(), text.find('\n', at) - at - begin.size());
  };
  const std::vector<std::byte> three = {std::byte{0x5A}, std::byte{0x22}, std::byte{0xFF}};
  EXPECT_EQ(printed(od::DataType::visible_string, three), "\"Z\\\".\"");
  EXPECT_EQ(printed(od::DataType::visible_string, {}), "\"\"");
  EXPECT_EQ(printed(od::DataType::octet_string, three), "5A 22 FF");
  EXPECT_EQ(printed(od::DataType::unicode_string, three), "5A 22 FF");
  EXPECT_EQ(printed(od::DataType::domain, three), "5A 22 FF");
  EXPECT_EQ(printed(od::DataType::unsigned24, three), "FF225Ah");
}

TEST(Check, SaysThatTheDdsGuardIsOff) {
  auto loaded = config::load(kDemo);
  ASSERT_TRUE(loaded.ok());
  EXPECT_FALSE(contains(describe(*loaded.value), "journal"));
  EXPECT_TRUE(YAML::Load(to_json(loaded))["journal"].IsNull());
  loaded.value->journal = config::Journal{"/x/journal.db", 20'000'000, std::chrono::hours(90 * 24)};
  EXPECT_TRUE(contains(describe(*loaded.value),
                       "journal /x/journal.db: up to 20MB, events up to 90d; values up to 50MB"));
  EXPECT_EQ(YAML::Load(to_json(loaded))["journal"]["max_age_s"].as<int>(), 90 * 86'400);
  EXPECT_FALSE(contains(describe(*loaded.value), "DDS guard"));
  loaded.value->dds_own_process = false;
  EXPECT_FALSE(contains(describe(*loaded.value), "process of its own"));
  loaded.value->dds_own_process = true;
  EXPECT_TRUE(contains(describe(*loaded.value), "DDS in a process of its own"));
  loaded.value->dds_guard = false;
  EXPECT_TRUE(contains(describe(*loaded.value), "DDS guard off"));
  EXPECT_FALSE(YAML::Load(to_json(loaded))["dds_guard"].as<bool>());
}

TEST(Check, NamesInterfacesAndPeersOfDds) {
  auto loaded = config::load(kDemo);
  ASSERT_TRUE(loaded.ok());
  EXPECT_FALSE(contains(describe(*loaded.value), "peers"));
  loaded.value->dds_interfaces = {"eth0", "eth1"};
  loaded.value->dds_peers = {"hall-b"};
  EXPECT_TRUE(contains(describe(*loaded.value), "DDS on the interfaces eth0, eth1 alone"));
  EXPECT_TRUE(contains(describe(*loaded.value), "DDS peers beside multicast: hall-b"));
  EXPECT_EQ(YAML::Load(to_json(loaded))["dds_peers"][0].as<std::string>(), "hall-b");
  EXPECT_FALSE(contains(describe(*loaded.value), "discovery servers"));
  loaded.value->dds_servers = {"10.0.0.9"};
  EXPECT_TRUE(contains(describe(*loaded.value), "DDS discovery servers: 10.0.0.9"));
  EXPECT_EQ(YAML::Load(to_json(loaded))["dds_discovery_servers"][0].as<std::string>(), "10.0.0.9");
  loaded.value->dds_routes_security = "/x/routes";
  EXPECT_TRUE(contains(describe(*loaded.value),
                       "requests to other gateways with the identity in /x/routes"));
  EXPECT_EQ(YAML::Load(to_json(loaded))["dds_routes_security"].as<std::string>(), "/x/routes");
}

TEST(Check, NamesImagesByMulticast) {
  auto loaded = config::load(kDemo);
  ASSERT_TRUE(loaded.ok());
  EXPECT_FALSE(contains(describe(*loaded.value), "multicast"));
  EXPECT_EQ(YAML::Load(to_json(loaded))["dds_fan_out"].as<std::string>(), "unicast");
  loaded.value->dds_multicast = true;
  EXPECT_TRUE(contains(describe(*loaded.value), "images by multicast to clients that ask for it"));
  EXPECT_EQ(YAML::Load(to_json(loaded))["dds_fan_out"].as<std::string>(), "multicast");
}

TEST(Check, SaysTheSameAsJson) {
  const auto loaded = config::load(kDemo);
  const YAML::Node json = YAML::Load(to_json(loaded));  // JSON is YAML
  EXPECT_TRUE(json["ok"].as<bool>());
  EXPECT_EQ(json["diagnostics"].size(), 0U);
  EXPECT_EQ(json["gateway"].as<std::string>(), "demo");
  ASSERT_EQ(json["lines"].size(), 3U);
  const YAML::Node press = json["lines"][0];
  EXPECT_EQ(press["name"].as<std::string>(), "press");
  EXPECT_EQ(press["sync_ns"].as<std::int64_t>(), 10'000'000);
  EXPECT_EQ(press["nodes"].size(), 4U);
  EXPECT_EQ(press["nodes"][0]["tpdos"][1]["cob_id"].as<int>(), 0x285);
  EXPECT_EQ(press["inputs_layout"]["entries"][0]["name"].as<std::string>(), "ram.Statusword");
  EXPECT_EQ(press["groups"][0]["entries"].size(), 8U);
}

TEST(Check, SaysWhichDevicesALineIsAndWhatFollowsWhat) {
  const auto loaded = config::load(paths::in_repository("deploy/plants/below-a-plc.yaml"));
  ASSERT_TRUE(loaded.ok());
  const std::string text = describe(*loaded.value);
  EXPECT_TRUE(contains(text, "device with 2 devices, network-ID 2")) << text;
  EXPECT_TRUE(contains(text, "device 10 panel: Generic I/O module (CiA 401) (profile 401)"));
  EXPECT_TRUE(contains(text, "TPDO1 18Ah on event: 6000:01/8 \"Inputs 1\""));
  EXPECT_TRUE(contains(text, "plc/drive.Statusword follows machine/ram.Statusword, held when"));
  EXPECT_TRUE(contains(text, "machine/ram.Controlword follows plc/drive.Controlword, 0 when"));
  const YAML::Node json = YAML::Load(to_json(loaded));
  EXPECT_EQ(json["lines"][1]["devices"][0]["name"].as<std::string>(), "panel");
  EXPECT_EQ(json["bindings"].size(), 6U);
}

TEST(Check, SaysThatTheOwnNodeObeysAnotherMaster) {
  const auto loaded = config::read(R"(schema: 1
lines:
  - {name: a, interface: 'virtual:p', role: device, node_id: 20}
  - {name: b, interface: 'virtual:q', role: device, node_id: 21, startup: {own_start: true}}
)",
                                   "x.yaml");
  ASSERT_TRUE(loaded.ok());
  const std::string text = describe(*loaded.value);
  EXPECT_TRUE(contains(text, "device with node-ID 20, network-ID 1")) << text;
  EXPECT_TRUE(contains(text, "started by its master; nodes are observed"));
  EXPECT_TRUE(contains(text, "started by itself; nodes are observed"));
}

// Nodes that another master boots, on a line in the role device or observer.
std::string observed_node(const std::string& role) {
  const auto loaded = config::read(
      "schema: 1\n"
      "lines:\n"
      "  - name: a\n"
      "    interface: 'virtual:p'\n"
      "    role: " +
          role + R"(
    node_id: 20
    sync: 10ms
    nodes:
      - {id: 5, name: io, eds: bridges/sim/eds/digital-io.eds, heartbeat: 200ms, mandatory: true, boot_timeout: 3s,
         objects: {6206:1: 4}}
)",
      paths::in_repository("x.yaml"));
  EXPECT_TRUE(loaded.ok());
  EXPECT_TRUE(YAML::Load(to_json(loaded))["lines"][0]["nodes"][0]["observed"].as<bool>());
  return describe(*loaded.value);
}

TEST(Check, SaysOfTheSlaveModeWhatIsDoneAsMasterAlone) {
  const std::string text = observed_node("device");
  EXPECT_TRUE(contains(text, "  heartbeat off, SYNC 10ms, TIME off\n")) << text;
  EXPECT_TRUE(contains(text, "  clients use up to 30% of the bit rate, each of them 15%\n"))
      << text;
  EXPECT_TRUE(
      contains(text,
               "  only when bit 0 of 1F80h makes it the NMT master: SDO time-out 500ms, reset "
               "nodes true, start nodes true, nodes started one by one"))
      << text;
  EXPECT_TRUE(contains(text,
                       "digital-io.eds)\n    heartbeat expected 200ms, consumer 2.5 x that\n"
                       "    only when bit 0 of 1F80h makes it the NMT master: mandatory, boot "
                       "within 3s, identity by"))
      << text;
  EXPECT_TRUE(
      contains(text, "    only when bit 0 of 1F80h makes it the NMT master: write 6206:01 ="))
      << text;
}

TEST(Check, SaysHowAFlyingMasterNegotiates) {
  const auto loaded = config::read(R"(schema: 1
lines:
  - {name: a, interface: 'virtual:p', node_id: 20, heartbeat: 200ms, flying_master: {priority: 1, detection: force}}
  - {name: b, interface: 'virtual:q', node_id: 21}
)",
                                   "x.yaml");
  ASSERT_TRUE(loaded.ok());
  const std::string text = describe(*loaded.value);
  EXPECT_TRUE(contains(text,
                       "  flying master: priority 1, waits 500ms and 100ms for the active master, "
                       "its turn after 1700ms; 076h each 4200ms, heartbeat of the master 400ms\n"))
      << text;
  const YAML::Node json = YAML::Load(to_json(loaded));
  EXPECT_EQ(json["lines"][0]["flying_master"]["priority"].as<int>(), 1);
  EXPECT_EQ(json["lines"][0]["flying_master"]["detection"].as<std::string>(), "force");
  EXPECT_TRUE(json["lines"][1]["flying_master"].IsNull());
}

TEST(Check, SaysOfAManagerWhoseOwnValueMakesItASlaveThatItIsOne) {
  const auto loaded = config::read(R"(schema: 1
lines:
  - {name: a, interface: 'virtual:p', own_values: {1F80:0: 4}}
  - {name: b, interface: 'virtual:q', role: device, node_id: 21, own_values: {1F80:0: 1}}
)",
                                   "x.yaml");
  ASSERT_TRUE(loaded.ok());
  const std::string text = describe(*loaded.value);
  EXPECT_TRUE(contains(
      text, "  manager, at the start device by its own value of 1F80:00, with node-ID 127"))
      << text;
  EXPECT_TRUE(contains(text, "  started by its master; nodes are observed")) << text;
  EXPECT_TRUE(contains(text, "  start-up: own node by itself, nodes started one by one")) << text;
  EXPECT_TRUE(
      contains(text, "  device, at the start manager by its own value of 1F80:00, with node-ID 21"))
      << text;
  const YAML::Node json = YAML::Load(to_json(loaded));
  EXPECT_EQ(json["lines"][0]["role"].as<std::string>(), "manager");
  EXPECT_EQ(json["lines"][0]["role_at_start"].as<std::string>(), "device");
  EXPECT_EQ(json["lines"][1]["role_at_start"].as<std::string>(), "manager");
}

TEST(Check, SaysNothingOfABootProcessOfAnObserver) {
  const std::string text = observed_node("observer");
  EXPECT_TRUE(contains(text, "  SYNC expected every 10ms\n")) << text;
  EXPECT_TRUE(contains(text, "    heartbeat expected 200ms, consumer 2.5 x that\n")) << text;
  for (const char* const none :
       {"mandatory", "boot within", "booted", "reset", "write", "identity", "1F80h", "start"}) {
    EXPECT_FALSE(contains(text, none)) << none << "\n" << text;
  }
}

TEST(Check, SaysWhatTheBootProcessCompares) {
  auto loaded = config::read(R"(schema: 1
lines:
  - {name: a, interface: 'virtual:p', nodes: [{id: 5, name: io, eds: bridges/sim/eds/digital-io.eds}]}
)",
                             paths::in_repository("x.yaml"));
  ASSERT_TRUE(loaded.ok());
  EXPECT_TRUE(
      contains(describe(*loaded.value), "identity by device type, vendor, product, revision"));
  od::DeviceDescription& device = loaded.value->lines[0].config.nodes[0].device;
  for (od::ObjectDescription& object : device.objects) {
    for (od::VariableDescription& variable : object.variables) {
      if (object.index == 0x1018 && variable.sub == 1) {
        std::ranges::fill(variable.value, std::byte{});
      }
    }
  }
  EXPECT_TRUE(contains(describe(*loaded.value), "identity by device type, product, revision"));
}

TEST(Check, SaysHowNetworksAreReachedAndWhoMayEnter) {
  const auto loaded = config::read(R"(schema: 1
routes: [{to: 10..19, via: hall:5}]
lines:
  - {name: press, interface: virtual:press, enter: [{from: hall, access: all}]}
  - {name: hall, interface: virtual:hall}
)",
                                   "x.yaml");
  ASSERT_TRUE(loaded.ok());
  const std::string text = describe(*loaded.value);
  EXPECT_TRUE(contains(text, "network 1 over line press, cost 0\n")) << text;
  EXPECT_TRUE(contains(text, "network 10..19 over line hall:5, cost 10\n"));
  EXPECT_TRUE(contains(text, "entered from networks 2: SDO\n"));
  EXPECT_TRUE(contains(text, "entered from no other network"));
  const YAML::Node json = YAML::Load(to_json(loaded));
  EXPECT_EQ(json["routes"][2]["line"].as<std::string>(), "hall");
  EXPECT_EQ(json["routes"][2]["node"].as<int>(), 5);
  EXPECT_EQ(json["lines"][0]["enter"][0]["services"].as<std::string>(), "SDO");
}

TEST(Check, SaysHowNetworksAreReachedOverOtherGateways) {
  const auto loaded = config::read(R"(schema: 1
routes:
  - {to: 7, via: hall-b/press, enter: pack, timeout: 4s}
  - {to: 20..29, via: hall-b/press, cost: 20}
lines:
  - {name: press, interface: virtual:press}
)",
                                   "x.yaml");
  ASSERT_TRUE(loaded.ok());
  const std::string text = describe(*loaded.value);
  EXPECT_TRUE(contains(text,
                       "network 7 over gateway hall-b, line press, entered as a device of line "
                       "pack, time-out 4s, cost 10\n"))
      << text;
  EXPECT_TRUE(contains(text,
                       "network 20..29 over gateway hall-b, line press, as a client, time-out 3s, "
                       "cost 20\n"))
      << text;
  const YAML::Node json = YAML::Load(to_json(loaded));
  EXPECT_EQ(json["routes"][0]["line"].as<std::string>(), "press");
  const YAML::Node over = json["routes"][1];
  EXPECT_EQ(over["line"].as<std::string>(), "") << "of this gateway";
  EXPECT_EQ(over["gateway"].as<std::string>(), "hall-b/press");
  EXPECT_EQ(over["enter"].as<std::string>(), "pack");
  EXPECT_EQ(over["timeout_ns"].as<std::int64_t>(), 4'000'000'000);
}

TEST(Check, SaysWhatTheOwnNodesEmcysCarry) {
  const auto loaded = config::read(R"(schema: 1
lines:
  - {name: press, interface: virtual:press, emcy_bytes: temporary_and_sticky}
  - {name: hall, interface: virtual:hall}
  - {name: seen, interface: virtual:seen, role: observer}
)",
                                   "x.yaml");
  ASSERT_TRUE(loaded.ok());
  const std::string text = describe(*loaded.value);
  EXPECT_TRUE(contains(text, "  EMCY bytes: temporary_and_sticky\n")) << text;
  EXPECT_TRUE(contains(text, "  EMCY bytes: number\n")) << text;
  EXPECT_EQ(text.find("EMCY bytes", text.find("line seen")), std::string::npos)
      << "an observer sends no EMCY";
  const YAML::Node json = YAML::Load(to_json(loaded));
  EXPECT_EQ(json["lines"][0]["emcy_bytes"].as<std::string>(), "temporary_and_sticky");
  EXPECT_EQ(json["lines"][1]["emcy_bytes"].as<std::string>(), "number");
}

TEST(Check, TellsOwnObjectsAndTheirPlaces) {
  const auto loaded = config::read(R"(schema: 1
lines:
  - name: press
    interface: virtual:press
    own_objects:
      2100:1: {name: Recipe, type: u16, access: rww, map: true, image: true}
      2100:2: {name: Note, type: vs}
    own_pdos: {rpdo40: {cob_id: 0x3AA, map: ["2100:1"]}}
)",
                                   "x.yaml");
  ASSERT_TRUE(loaded.ok());
  const std::string text = describe(*loaded.value);
  EXPECT_TRUE(contains(text, "  own object 2100:01 Recipe: UNSIGNED16, for PDOs, in the image\n"))
      << text;
  EXPECT_TRUE(contains(text, "  own object 2100:02 Note: VISIBLE_STRING\n")) << text;
  EXPECT_TRUE(contains(text, "own.Recipe")) << text;
}

TEST(Check, SaysThatALineIsOfCanopenFd) {
  const auto loaded = config::read(
      "schema: 1\nlines: [{name: a, interface: 'simulated:', canopen_fd: true, data_bit_rate: "
      "5Mbit, "
      "usdo_abort: four-bytes, nodes: [{id: 5, eds: bridges/sim/eds/fd-io.eds}]}]\n",
      paths::in_repository("plant.yaml"));
  ASSERT_TRUE(loaded.ok());
  const std::string text = describe(*loaded.value);
  EXPECT_TRUE(
      contains(text,
               "  CANopen FD, data bit rate 5000000 bit/s, aborts of USDO with four bytes, EMCYs "
               "of 8 bytes\n"))
      << text;
  EXPECT_TRUE(contains(text, "6000:40/8")) << "a PDO of 64 bytes: " << text;
  const auto line = YAML::Load(to_json(loaded))["lines"][0];
  EXPECT_TRUE(line["canopen_fd"].as<bool>());
  EXPECT_EQ(line["data_bit_rate"].as<unsigned>(), 5'000'000U);
  EXPECT_EQ(line["usdo_abort"].as<std::string>(), "four-bytes");
  EXPECT_EQ(line["nodes"][0]["tpdos"].size(), 1U);
}

TEST(Check, SaysThatDevicesHaveNamedTopics) {
  const auto loaded = config::read(R"(schema: 1
lines:
  - name: a
    interface: "simulated:"
    named: {min_separation: 50ms, ros2: true, aliases: {ram.6041: State}}
    nodes: [{id: 5, name: ram, eds: bridges/sim/eds/drive.eds}]
)",
                                   paths::in_repository("plant.yaml"));
  ASSERT_TRUE(loaded.ok());
  const std::string text = describe(*loaded.value);
  EXPECT_TRUE(contains(
      text, "  a topic of each device and direction: plant/a/DEVICE/inputs, .../outputs\n"))
      << text;
  EXPECT_TRUE(contains(text,
                       "  the same for ROS 2: /plant/a/DEVICE/inputs, .../outputs, package "
                       "linegate_plant\n"))
      << text;
  EXPECT_TRUE(contains(text, "  at most one sample of such a topic in 50ms\n")) << text;
  EXPECT_TRUE(contains(text, "  inputs ram.Statusword is called State in its topic\n")) << text;
  const YAML::Node line = YAML::Load(to_json(loaded))["lines"][0];
  EXPECT_TRUE(line["named"].as<bool>());
  EXPECT_TRUE(line["named_ros2"].as<bool>());
  EXPECT_EQ(line["named_min_separation_ns"].as<int>(), 50'000'000);
  EXPECT_EQ(line["aliases"][0]["identifier"].as<std::string>(), "State");
}

TEST(Check, SaysWhichGroupsAreWrittenByName) {
  const auto loaded = config::read(R"(schema: 1
lines:
  - name: a
    interface: "simulated:"
    nodes: [{id: 5, name: ram, eds: bridges/sim/eds/drive.eds}]
    outputs:
      groups:
        - {name: drives, written_by: named, entries: [ram.6040]}
        - {name: modes, entries: [ram.6060]}
)",
                                   paths::in_repository("plant.yaml"));
  ASSERT_TRUE(loaded.ok());
  const std::string text = describe(*loaded.value);
  EXPECT_TRUE(contains(text,
                       "  output group 1 drives, sent on change, written by "
                       "plant/a/drives/outputs/set: ram.Controlword\n"))
      << text;
  EXPECT_TRUE(contains(text, "  output group 2 modes, sent on change: ram.Modes of operation\n"))
      << text;
  const YAML::Node groups = YAML::Load(to_json(loaded))["lines"][0]["groups"];
  EXPECT_EQ(groups[0]["written_by"].as<std::string>(), "named");
  EXPECT_EQ(groups[1]["written_by"].as<std::string>(), "output_write");
}

TEST(Check, SaysWhichOutputsFollowAnotherGateway) {
  const auto loaded = config::read(R"(schema: 1
forward:
  - {from: hall-b/press.axis.Speed, to: a.ram.6060:0, timeout: 500ms, when_lost: [zero, emcy]}
lines:
  - name: a
    interface: "simulated:"
    nodes: [{id: 5, name: ram, eds: bridges/sim/eds/drive.eds}]
)",
                                   paths::in_repository("plant.yaml"));
  ASSERT_TRUE(loaded.ok());
  const std::string text = describe(*loaded.value);
  EXPECT_TRUE(contains(text,
                       "forward hall-b/press.axis.Speed of another gateway -> a/ram.Modes of "
                       "operation as output group 65535, zero, emcy after 500ms without a valid "
                       "value\n"))
      << text;
  EXPECT_TRUE(contains(text,
                       "  output group 65535 hall-b/press.axis.Speed, sent on change, written by "
                       "that line of another gateway: ram.Modes of operation\n"))
      << text;
  const YAML::Node json = YAML::Load(to_json(loaded));
  const YAML::Node input = json["remote_inputs"][0];
  EXPECT_EQ(input["gateway"].as<std::string>(), "hall-b");
  EXPECT_EQ(input["from"].as<std::string>(), "press");
  EXPECT_EQ(input["input"].as<std::string>(), "axis.Speed");
  EXPECT_EQ(input["timeout_ns"].as<std::int64_t>(), 500'000'000);
  EXPECT_EQ(input["when_lost"][1].as<std::string>(), "emcy");
  EXPECT_EQ(json["lines"][0]["groups"][0]["written_by"].as<std::string>(), "forward");
}

TEST(Check, SaysThatALineTakesItsNodesFromAScan) {
  const std::string head = "schema: 1\nlines:\n  - {name: a, interface: 'simulated:', auto: ";
  const auto bare = config::read(head + "true}\n", paths::in_repository("plant.yaml"));
  ASSERT_TRUE(bare.ok());
  EXPECT_TRUE(contains(describe(*bare.value),
                       "nodes: found by a scan at the start; nothing is written to them\n"));
  const auto more = config::read(head + "{at_start: false, set_up: true, eds: bridges/sim/eds}}\n",
                                 paths::in_repository("plant.yaml"));
  ASSERT_TRUE(more.ok());
  EXPECT_TRUE(
      contains(describe(*more.value),
               "nodes: found by a scan; missing error control is configured, heartbeat 500ms; "
               "device files in " +
                   paths::in_repository("bridges/sim/eds\n")));
}

TEST(Check, PutsFindingsIntoTheJson) {
  const auto loaded = config::read("schema: 1\nlines: 3\n", "x.yaml");
  const YAML::Node json = YAML::Load(to_json(loaded));
  EXPECT_FALSE(json["ok"].as<bool>());
  ASSERT_EQ(json["diagnostics"].size(), 1U);
  EXPECT_EQ(json["diagnostics"][0]["line"].as<int>(), 2);
  EXPECT_EQ(json["diagnostics"][0]["text"].as<std::string>(), "lines is a list, not \"3\"");
}

// Scripts compare the JSON text: one line, members in a fixed order, 64-bit numbers in full,
// strings of any octets.
TEST(JsonText, WritesCommasAndEscapes) {
  const Json json{{"b", 1U},
                  {"a", true},
                  {"c", "x\"\\\n\x1B"},
                  {"d", {1, Json::object()}},
                  {"e", std::int64_t{9'223'372'036'854'775'807}},
                  {"f", "\xFF"}};
  EXPECT_EQ(json_text(json),
            "{\"b\":1,\"a\":true,\"c\":\"x\\\"\\\\\\n\\u001b\",\"d\":[1,{}],"
            "\"e\":9223372036854775807,\"f\":\"\xEF\xBF\xBD\"}");
}

TEST(Check, FindsWhatIsWrongWithTheDdsProfiles) {
  namespace fs = std::filesystem;
  const fs::path folder =
      fs::path(testing::TempDir()) / ("check-profiles-" + std::to_string(::getpid()));
  fs::create_directory(folder);
  std::ofstream(folder / "bad.xml") << "<dds>\n<profiles>\n</dds>\n";
  std::ofstream(folder / "plant.yaml")
      << "schema: 1\ndds: {profile: bad.xml}\nlines:\n  - {name: a, interface: 'simulated:'}\n";
  testing::internal::CaptureStderr();
  EXPECT_EQ(check((folder / "plant.yaml").string(), false), kExitUsage);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_TRUE(contains(said, "bad.xml:3:")) << said;
  EXPECT_TRUE(contains(said, "error: not a usable file of DDS profiles: ")) << said;
  fs::remove_all(folder);
}

}  // namespace
}  // namespace linegate::gateway
