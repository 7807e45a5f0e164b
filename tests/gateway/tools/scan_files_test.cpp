// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/scan_files.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "gateway/config/found_nodes.h"
#include "gateway/config/plant.h"
#include "stack/base/byte_order.h"
#include "stack/line/line.h"

namespace linegate::gateway {
namespace {

scan::ScannedNode encoder_5() {
  scan::ScannedNode node{.id = 5};
  for (const auto& [address, value] :
       {std::pair{od::Address{0x1000, 0}, 0x196U}, {od::Address{0x1018, 1}, 7U}}) {
    std::vector<std::byte> data(4);
    store_le(std::span(data), std::uint64_t{value});
    node.values.push_back({address, data});
  }
  return node;
}

// The written configuration has the domain and the access of the scanning gateway, so that clients
// reach the line in the same way.
TEST(ScanFiles, TheConfigurationHasDomainAndAccessOfTheLine) {
  const std::string folder = testing::TempDir() + "/scan-files";
  std::filesystem::remove_all(folder);
  const ScanFiles files = write_scan({.gateway = "lab",
                                      .name = "press",
                                      .interface_uri = "virtual:p",
                                      .access = "all",
                                      .outputs_access = "all",
                                      .dds_domain = 77,
                                      .nodes = {encoder_5()}},
                                     folder, "");
  ASSERT_TRUE(files.ok) << files.error;
  const auto loaded = config::load(folder + "/plant.yaml");
  ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.at(0));
  EXPECT_EQ(loaded.value->dds_domain, 77U);
  EXPECT_EQ(loaded.value->lines[0].commands, config::Access::all);
  EXPECT_EQ(loaded.value->lines[0].outputs, config::Access::all);
  ASSERT_EQ(loaded.value->lines[0].config.nodes.size(), 1U);
  EXPECT_FALSE(
      write_scan({.gateway = "lab", .name = "press", .interface_uri = "virtual:p"}, folder, "").ok)
      << "nothing is overwritten";
  std::filesystem::remove_all(folder);
}

// The name of a line is received from the network, and file names are derived from it.
TEST(ScanFiles, ANameThatLeavesTheFolderIsRefused) {
  const std::string folder = testing::TempDir() + "/scan-names/inner";
  std::filesystem::remove_all(testing::TempDir() + "/scan-names");
  for (const char* const name : {"../outside", "/tmp/outside", "a/b", "a b", "", "x\x1b[2J"}) {
    const ScanFiles files = write_scan(
        {.gateway = "lab", .name = name, .interface_uri = "virtual:p", .nodes = {encoder_5()}},
        folder, "");
    EXPECT_FALSE(files.ok) << name;
    EXPECT_TRUE(files.written.empty()) << name;
  }
  EXPECT_FALSE(std::filesystem::exists(testing::TempDir() + "/scan-names"));
}

TEST(ScanFiles, CommandsAndOutputsOfDifferentAccessKeepIt) {
  const std::string folder = testing::TempDir() + "/scan-access";
  std::filesystem::remove_all(folder);
  ASSERT_TRUE(write_scan({.gateway = "lab",
                          .name = "press",
                          .interface_uri = "virtual:p",
                          .access = "read",
                          .outputs_access = "off",
                          .nodes = {encoder_5()}},
                         folder, "")
                  .ok);
  const auto loaded = config::load(folder + "/plant.yaml");
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(loaded.value->lines[0].commands, config::Access::read);
  EXPECT_EQ(loaded.value->lines[0].outputs, config::Access::off);
  std::filesystem::remove_all(folder);
}

void put(scan::ScannedNode& node, od::Address address, std::uint64_t value, std::size_t size) {
  std::vector<std::byte> data(size);
  store_le(std::span(data), value);
  node.values.push_back({address, data});
}

// A gateway with the written configuration reports the loss of a device.
TEST(ScanFiles, TheConfigurationHasErrorControlWhereADeviceCan) {
  scan::ScannedNode heartbeat = encoder_5();
  put(heartbeat, {0x1017, 0}, 0, 2);
  scan::ScannedNode guarded = encoder_5();
  guarded.id = 6;
  put(guarded, {0x100C, 0}, 0, 2);
  put(guarded, {0x100D, 0}, 0, 1);
  scan::ScannedNode neither = encoder_5();
  neither.id = 7;
  scan::ScannedNode own = encoder_5();
  own.id = 8;
  put(own, {0x1017, 0}, 250, 2);
  const std::string folder = testing::TempDir() + "/scan-error-control";
  std::filesystem::remove_all(folder);
  const ScanFiles files = write_scan({.gateway = "lab",
                                      .name = "press",
                                      .interface_uri = "virtual:p",
                                      .nodes = {heartbeat, guarded, neither, own}},
                                     folder, "");
  ASSERT_TRUE(files.ok) << files.error;
  const auto loaded = config::load(folder + "/plant.yaml");
  ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.at(0));
  const auto& nodes = loaded.value->lines[0].config.nodes;
  ASSERT_EQ(nodes.size(), 4U);
  EXPECT_EQ(nodes[0].heartbeat, std::chrono::milliseconds(500));
  EXPECT_EQ(nodes[1].guard_time, std::chrono::milliseconds(500));
  EXPECT_EQ(nodes[1].life_time_factor, 3);
  EXPECT_EQ(nodes[2].heartbeat + nodes[2].guard_time, Duration::zero());
  EXPECT_EQ(nodes[3].heartbeat, std::chrono::milliseconds(250))
      << "the heartbeat time of the device";
  EXPECT_EQ(loaded.value->lines[0].config.sync_period, Duration::zero()) << "nobody waits for it";
  std::ifstream in(folder + "/plant.yaml");
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  EXPECT_NE(text.find("# no heartbeat, no guarding: the loss of this node is not detected"),
            std::string::npos);
  EXPECT_TRUE(std::ranges::any_of(files.notes, [](const std::string& note) {
    return note == "node 7: has neither heartbeat nor guarding, its loss is not detected";
  }));
  std::filesystem::remove_all(folder);
}

void put_product(scan::ScannedNode& node, const std::string& product) {
  const auto text = std::as_bytes(std::span(product));
  node.values.push_back({{0x1008, 0}, {text.begin(), text.end()}});
}

TEST(ScanFiles, NodesAreNamedAfterTheirProduct) {
  std::vector<scan::ScannedNode> nodes;
  for (const std::string& product :
       {std::string("Encoder"), std::string("Encoder"), std::string("  8 DI/8 DO (24\xB0 V)\0", 21),
        std::string(80, 'x'), std::string("\"#: \n"), std::string()}) {
    nodes.push_back(encoder_5());
    nodes.back().id = static_cast<std::uint8_t>(4 + nodes.size());
    put_product(nodes.back(), product);
  }
  const std::string folder = testing::TempDir() + "/scan-names";
  std::filesystem::remove_all(folder);
  const ScanFiles files =
      write_scan({.gateway = "lab", .name = "press", .interface_uri = "virtual:p", .nodes = nodes},
                 folder, "");
  ASSERT_TRUE(files.ok) << files.error;
  const auto loaded = config::load(folder + "/plant.yaml");
  ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.at(0));
  std::vector<std::string> names;
  for (const line::NodeConfig& node : loaded.value->lines[0].config.nodes) {
    names.push_back(node.name);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"Encoder-5", "Encoder-6", "8-DI-8-DO-24-V-7",
                                             std::string(62, 'x') + "-8", "node9", "node10"}));
  std::filesystem::remove_all(folder);
}

// One TPDO with one value of 4 bytes.
scan::ScannedNode with_tpdo() {
  scan::ScannedNode node = encoder_5();
  put(node, {0x1800, 0}, 2, 1);
  put(node, {0x1800, 1}, 0x4000'0185U, 4);
  put(node, {0x1800, 2}, 254, 1);
  put(node, {0x1A00, 0}, 1, 1);
  put(node, {0x1A00, 1}, 0x6004'0020, 4);
  return node;
}

// Any participant of the DDS domain can publish an interface name.
TEST(ScanFiles, AnInterfaceThatNoPlantCanHaveIsRefused) {
  const std::string folder = testing::TempDir() + "/scan-interface";
  std::filesystem::remove_all(folder);
  for (const char* const interface : {"", "nothing:p", "udp:", "virtual:p?x=\x1b[2J"}) {
    const ScanFiles files =
        write_scan({.gateway = "lab", .name = "press", .interface_uri = interface}, folder, "");
    EXPECT_FALSE(files.ok) << interface;
    EXPECT_EQ(files.error.find("'" + std::string(interface) + "' is not an interface"), 0U)
        << files.error;
    EXPECT_FALSE(std::filesystem::exists(folder));
  }
}

TEST(ScanFiles, AnotherLayoutThanThatOfTheRunningLineIsReportedWithItsReason) {
  const std::string folder = testing::TempDir() + "/scan-layout";
  ScannedLine line{
      .gateway = "lab", .name = "press", .interface_uri = "virtual:p", .nodes = {with_tpdo()}};
  const auto notes_with = [&](std::optional<image::Layout> running) {
    std::filesystem::remove_all(folder);
    line.layouts[0] = std::move(running);
    const ScanFiles files = write_scan(line, folder, "");
    EXPECT_TRUE(files.ok) << files.error;
    std::string out;
    for (const std::string& note : files.notes) {
      out += note.starts_with("the layout_id") ? note.substr(note.find(": ")) : "";
    }
    return out;
  };
  EXPECT_EQ(notes_with(std::nullopt), "");
  const auto loaded = config::load(folder + "/plant.yaml");
  ASSERT_TRUE(loaded.ok());
  const auto made = line::Line::make(loaded.value->lines[0].config);
  image::Layout same = (*made.value)->layout(image::Direction::inputs);
  ASSERT_EQ(same.entries.size(), 1U);
  EXPECT_EQ(notes_with(same), "") << "the same layout";
  image::Layout other = same;
  other.entries[0].type = od::DataType::real32;
  other.id = image::layout_id(other);
  EXPECT_EQ(notes_with(other), ": entry 0, 6004:00 of node 5, is UNSIGNED32, not REAL32");
  other = same;
  other.entries.push_back(same.entries[0]);
  other.id = image::layout_id(other);
  EXPECT_EQ(notes_with(other), ": it has 1 entries, not 2: other PDOs are mapped or enabled");
  other.entries.clear();
  other.id = image::layout_id(other);
  EXPECT_EQ(notes_with(other), "") << "the line runs without a configuration";
  std::filesystem::remove_all(folder);
}

TEST(ScanFiles, TheConfigurationProducesTheSyncThatPdosWaitFor) {
  scan::ScannedNode node = encoder_5();
  put(node, {0x1800, 0}, 2, 1);
  put(node, {0x1800, 1}, 0x4000'0185U, 4);
  put(node, {0x1800, 2}, 1, 1);
  put(node, {0x1A00, 0}, 1, 1);
  put(node, {0x1A00, 1}, 0x6004'0020, 4);
  for (const std::uint32_t period : {0U, 20'000U}) {
    const std::string folder = testing::TempDir() + "/scan-sync";
    std::filesystem::remove_all(folder);
    scan::ScannedNode found = node;
    put(found, {0x1006, 0}, period, 4);
    const ScanFiles files = write_scan(
        {.gateway = "lab", .name = "press", .interface_uri = "virtual:p", .nodes = {found}}, folder,
        "");
    ASSERT_TRUE(files.ok) << files.error;
    const auto loaded = config::load(folder + "/plant.yaml");
    ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.at(0));
    EXPECT_EQ(loaded.value->lines[0].config.sync_period,
              std::chrono::milliseconds(period == 0 ? 100 : 20));
    std::filesystem::remove_all(folder);
  }
}

TEST(ScanFiles, ALineThatProducesSyncKeepsItsPeriod) {
  const std::string folder = testing::TempDir() + "/scan-own-sync";
  std::filesystem::remove_all(folder);
  scan::ScannedNode node = with_tpdo();
  put(node, {0x1006, 0}, 20'000, 4);
  const ScanFiles files = write_scan({.gateway = "lab",
                                      .name = "press",
                                      .interface_uri = "virtual:p",
                                      .sync_period = std::chrono::milliseconds(10),
                                      .nodes = {node}},
                                     folder, "");
  ASSERT_TRUE(files.ok) << files.error;
  const auto loaded = config::load(folder + "/plant.yaml");
  ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.at(0));
  EXPECT_EQ(loaded.value->lines[0].config.sync_period, std::chrono::milliseconds(10));
  std::filesystem::remove_all(folder);
}

TEST(ScanFiles, ALineOfCanopenFdStaysOne) {
  const std::string folder = testing::TempDir() + "/scan-fd";
  std::filesystem::remove_all(folder);
  scan::ScannedNode node = encoder_5();
  put(node, {0x1800, 0}, 2, 1);
  put(node, {0x1800, 1}, 0x4000'0185U, 4);
  put(node, {0x1800, 2}, 255, 1);
  put(node, {0x1A00, 0}, 3, 1);
  for (std::uint8_t sub = 1; sub <= 3; ++sub) {
    put(node, {0x1A00, sub}, 0x6004'0020U + sub * 0x1'0000U, 4);
  }
  const ScanFiles files = write_scan({.gateway = "lab",
                                      .name = "press",
                                      .interface_uri = "virtual:p",
                                      .bit_rate = 1'000'000,
                                      .canopen_fd = true,
                                      .data_bit_rate = 5'000'000,
                                      .usdo_abort = usdo::AbortForm::four_bytes,
                                      .flying_master = 1,
                                      .nodes = {node}},
                                     folder, "");
  ASSERT_TRUE(files.ok) << files.error;
  for (const std::string& note : files.notes) {
    EXPECT_EQ(note.find("TPDO 1 is left out"), std::string::npos) << note;
  }
  const auto loaded = config::load(folder + "/plant.yaml");
  ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.at(0));
  const line::LineConfig& line = loaded.value->lines[0].config;
  EXPECT_TRUE(line.canopen_fd);
  EXPECT_EQ(line.data_bit_rate, 5'000'000U);
  EXPECT_EQ(line.usdo_abort, usdo::AbortForm::four_bytes);
  ASSERT_TRUE(line.flying_master);
  EXPECT_EQ(line.flying_master->priority, 1);
  std::filesystem::remove_all(folder);
}

// A user may keep the files of each device in a folder of that name.
TEST(ScanFiles, AFolderNamedAsAnEdsIsNone) {
  const std::string folder = testing::TempDir() + "/scan-folder-of-eds";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder + "/encoder.eds");
  const std::vector<scan::ScannedNode> nodes{encoder_5()};
  const config::FoundNodes found = config::found_nodes(nodes, folder, 64);
  EXPECT_EQ(found.error, "");
  ASSERT_EQ(found.nodes.size(), 1U);
  EXPECT_EQ(found.nodes[0].sheet, "");
  std::filesystem::remove_all(folder);
}

TEST(ScanFiles, AnEdsThatFailsWhileItIsReadIsNamed) {
  const std::string folder = testing::TempDir() + "/scan-eds-on-a-bad-disk";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  // Reading it fails with EIO.
  std::filesystem::create_symlink("/proc/self/mem", folder + "/encoder.eds");
  const std::vector<scan::ScannedNode> nodes{encoder_5()};
  EXPECT_EQ(config::found_nodes(nodes, folder, 64).error, folder + "/encoder.eds: cannot be read");
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace linegate::gateway
