// SPDX-License-Identifier: Apache-2.0
// `pdos:` of a node, and the resulting configuration of the device.
#include <string>

#include <gtest/gtest.h>

#include "gateway/config/plant.h"
#include "stack/line/line.h"
#include "stack/od/dictionary.h"

#include "tests/paths.h"

namespace linegate::config {
namespace {

using namespace std::chrono_literals;

std::string pdo_findings(const Loaded<Plant>& loaded) {
  std::string out;
  for (const auto& diagnostic : loaded.diagnostics) {
    out += to_string(diagnostic) + '\n';
  }
  return out;
}

Loaded<Plant> read_pdo_plant(const std::string& text) {
  return read(text, paths::in_repository("plant.yaml"));
}

TEST(Plant, WritesAPdoInTheOrderOfCia301) {
  const auto loaded = read_pdo_plant(R"(schema: 1
lines:
  - name: a
    interface: "simulated:"
    nodes:
      - id: 5
        eds: bridges/sim/eds/drive.eds
        pdos:
          tpdo1: {type: event, inhibit: 10ms, event_timer: 1s, cob_id: 0x1C5, map: [6041, 6064]}
)");
  ASSERT_TRUE(loaded.ok()) << pdo_findings(loaded);
  const auto& node = loaded.value->lines.at(0).config.nodes.at(0);
  struct Write {
    od::Address address;
    std::uint64_t value;
    bool operator==(const Write&) const = default;
  };
  std::vector<Write> written;
  for (const auto& object : node.objects) {
    std::uint64_t value = 0;
    for (auto it = object.data.rbegin(); it != object.data.rend(); ++it) {
      value = value << 8U | std::to_integer<std::uint64_t>(*it);
    }
    written.push_back({object.address, value});
  }
  const std::vector<Write> expected{
      {{0x1800, 1}, 0xC000'01C5}, {{0x1800, 2}, 255}, {{0x1800, 3}, 100},
      {{0x1800, 5}, 1000},        {{0x1A00, 0}, 0},   {{0x1A00, 1}, 0x6041'0010},
      {{0x1A00, 2}, 0x6064'0020}, {{0x1A00, 0}, 2},   {{0x1800, 1}, 0x4000'01C5},
  };
  EXPECT_TRUE(written == expected);

  const auto made = line::Line::make(loaded.value->lines.at(0).config);
  ASSERT_TRUE(made.ok());
  const auto& entries = (*made.value)->layout(image::Direction::inputs).entries;
  EXPECT_TRUE(std::any_of(entries.begin(), entries.end(), [](const auto& e) {
    return e.index == 0x6064 && e.remote_pdo == 1;
  })) << "the line links what the device will send";
}

TEST(Plant, APdoThatIsDisabledIsTakenAwayOnce) {
  const auto loaded = read_pdo_plant(R"(schema: 1
lines:
  - name: a
    interface: "simulated:"
    nodes:
      - {id: 5, eds: bridges/sim/eds/drive.eds, pdos: {tpdo1: {enabled: false, event_timer: 40ms}}}
)");
  ASSERT_TRUE(loaded.ok()) << pdo_findings(loaded);
  std::vector<od::Address> written;
  for (const line::ObjectValue& object : loaded.value->lines.at(0).config.nodes.at(0).objects) {
    written.push_back(object.address);
  }
  EXPECT_EQ(written, (std::vector<od::Address>{{0x1800, 1}, {0x1800, 5}}));
}

// The key `every` concerns the gateway only: nothing is written to the device for it.
TEST(Plant, EveryReceptionOfAPdoIsQueuedWhereItIsSaid) {
  const auto plant = [](const std::string& line, const std::string& pdos) {
    return read_pdo_plant("schema: 1\nlines:\n  - name: a\n    interface: \"simulated:\"\n" + line +
                          "    nodes:\n      - id: 5\n        eds: bridges/sim/eds/drive.eds\n"
                          "        pdos: {" +
                          pdos + "}\n");
  };
  const auto one = plant("", "tpdo1: {every: true}, tpdo2: {every: true, queue: 500}");
  ASSERT_TRUE(one.ok()) << pdo_findings(one);
  const line::LineConfig& config = one.value->lines.at(0).config;
  EXPECT_TRUE(config.nodes.at(0).objects.empty());
  EXPECT_EQ(line::queue_of(config, 5, 1), 64U);
  EXPECT_EQ(line::queue_of(config, 5, 2), 500U);
  EXPECT_EQ(line::queue_of(config, 5, 3), 0U);
  EXPECT_EQ(line::longest_queue(config), 500U);

  const auto all = plant("    pdo_update: {every: true, queue: 10}\n", "tpdo2: {every: false}");
  ASSERT_TRUE(all.ok()) << pdo_findings(all);
  EXPECT_EQ(line::queue_of(all.value->lines.at(0).config, 5, 1), 10U);
  EXPECT_EQ(line::queue_of(all.value->lines.at(0).config, 5, 2), 0U);

  EXPECT_NE(pdo_findings(plant("", "tpdo1: {queue: 10}")).find("queue needs every: true"),
            std::string::npos);
  EXPECT_NE(pdo_findings(plant("", "rpdo1: {every: true}")).find("unknown key \"every\""),
            std::string::npos);
  EXPECT_NE(pdo_findings(plant("    role: device\n    pdo_update: {every: true}\n", ""))
                .find("every is of lines in the roles manager and observer"),
            std::string::npos);
}

TEST(Plant, APdoOfADeviceIsMadeMultiplexedAndMayBeRequested) {
  const auto loaded = read_pdo_plant(R"(schema: 1
lines:
  - name: a
    interface: "simulated:"
    nodes:
      - id: 5
        eds: bridges/sim/eds/drive.eds
        pdos:
          tpdo1: {mpdo: source, cob_id: 0x1C5}
          tpdo2: {rtr: true}
)");
  ASSERT_TRUE(loaded.ok()) << pdo_findings(loaded);
  const auto& objects = loaded.value->lines.at(0).config.nodes.at(0).objects;
  std::vector<std::pair<std::uint16_t, unsigned>> written;
  for (const line::ObjectValue& object : objects) {
    if (object.address.sub == 0) {
      written.emplace_back(object.address.index, std::to_integer<unsigned>(object.data[0]));
    }
    if (object.address == od::Address{0x1801, 1}) {
      EXPECT_EQ(std::to_integer<unsigned>(object.data[3]) & 0x40U, 0U) << "RTR is allowed";
    }
  }
  EXPECT_EQ(written, (std::vector<std::pair<std::uint16_t, unsigned>>{{0x1A00, 0}, {0x1A00, 254}}));
}

std::string own_mpdos(const std::string& own_pdos, const std::string& lists) {
  return R"(schema: 1
lines:
  - name: a
    interface: virtual:a
    nodes: [{id: 5, eds: bridges/sim/eds/drive.eds}]
    own_objects:
      "2100:1": {type: u32, map: true}
      "2100:2": {type: u32, map: true}
      "2101": {type: u32}
    own_pdos: {)" +
         own_pdos + "}\n" + lists;
}

TEST(Plant, MpdosOfTheOwnNodeAreConfigured) {
  const auto loaded = read_pdo_plant(
      own_mpdos("tpdo100: {cob_id: 0x1F0, mpdo: destination, map: [\"2100:1\"]}, "
                "tpdo101: {cob_id: 0x1F1, mpdo: source}, rpdo100: {cob_id: 0x1F2, mpdo: source}, "
                "rpdo101: {cob_id: 0x1F3, mpdo: destination, rtr: true}",
                "    mpdo_scanner: [{object: \"2100:1\", count: 2}]\n"
                "    mpdo_dispatcher: [{node: 5, object: \"6000:1\", own: \"2100:2\"}]\n"));
  ASSERT_TRUE(loaded.ok()) << pdo_findings(loaded);
  const line::LineConfig& config = loaded.value->lines.at(0).config;
  EXPECT_EQ(config.forwarding.tpdos.at(0).mpdo, pdo::MpdoMode::destination);
  EXPECT_EQ(config.forwarding.tpdos.at(1).mpdo, pdo::MpdoMode::source);
  EXPECT_EQ(config.mpdo_scanner, std::vector<std::uint32_t>{0x02'2100'01});
  EXPECT_EQ(config.mpdo_dispatcher, std::vector<std::uint64_t>{0x01'2100'02'6000'01'05});
  EXPECT_EQ(config.forwarding.rpdos.at(0).cob_id.raw, 0x4000'01F2U);
  EXPECT_EQ(config.forwarding.rpdos.at(1).cob_id.raw, 0x0000'01F3U);
}

TEST(Plant, MpdosThatCannotBeAreFound) {
  const auto found = [](const std::string& own_pdos, const std::string& lists = "") {
    return pdo_findings(read_pdo_plant(own_mpdos(own_pdos, lists)));
  };
  EXPECT_NE(found("tpdo100: {cob_id: 0x1F0, mpdo: destination}").find("maps the one object"),
            std::string::npos);
  EXPECT_NE(found("rpdo100: {cob_id: 0x1F0, mpdo: source, map: [\"2100:1\"]}").find("maps nothing"),
            std::string::npos);
  EXPECT_NE(found("tpdo100: {cob_id: 0x1F0, mpdo: source, type: sync}").find("event-driven"),
            std::string::npos);
  EXPECT_NE(found("", "    mpdo_scanner: [{object: \"2101:0\"}]\n").find("2101:00 is no object of"),
            std::string::npos);
  EXPECT_NE(found("", "    mpdo_dispatcher: [{node: 5, object: 6000, own: \"2100:2\", count: 2}]\n")
                .find("2100:03 is no object of"),
            std::string::npos);
}

TEST(Plant, AnRpdoOfADeviceIsSentToItNoMoreOftenThanItsInhibitTime) {
  const auto loaded = read_pdo_plant(R"(schema: 1
lines:
  - name: a
    interface: "simulated:"
    nodes:
      - id: 5
        eds: bridges/sim/eds/drive.eds
        pdos: {rpdo1: {type: event, inhibit: 10ms}, rpdo2: {type: sync, inhibit: 10ms}}
)");
  ASSERT_TRUE(loaded.ok()) << pdo_findings(loaded);
  const auto& config = loaded.value->lines.at(0).config;
  for (const auto& object : config.nodes.at(0).objects) {
    EXPECT_NE(object.address.sub, 3) << "the inhibit time is not written to the device";
  }
  const auto made = line::Line::make(config);
  ASSERT_TRUE(made.ok());
  EXPECT_EQ((*made.value)->dictionary().number({0x1800, 3}), 100U);
  EXPECT_EQ((*made.value)->dictionary().number({0x1801, 3}), 0U)
      << "a synchronous PDO needs no inhibit time";
}

// Both nodes have the same device file, so the name of the file does not identify the node.
TEST(Plant, APdoOnTheCobIdOfAnotherIsToldAtItsNode) {
  const auto loaded = read_pdo_plant(R"(schema: 1
lines:
  - name: a
    interface: "simulated:"
    nodes:
      - {id: 5, eds: bridges/sim/eds/drive.eds}
      - id: 6
        eds: bridges/sim/eds/drive.eds
        pdos: {tpdo1: {cob_id: 0x185}, rpdo1: {cob_id: 0x80}}
)");
  EXPECT_FALSE(loaded.ok());
  const std::string root = paths::kRepository;
  const std::string where = root + "/plant.yaml:7:9: error: ";
  const std::string file = " (" + root + "/bridges/sim/eds/drive.eds)\n";
  EXPECT_EQ(pdo_findings(loaded), where + "RPDO 1 of node6 has the COB-ID of SYNC" + file + where +
                                      "TPDO 1 of node6 has the COB-ID of TPDO 1 of node5" + file);
}

}  // namespace
}  // namespace linegate::config
