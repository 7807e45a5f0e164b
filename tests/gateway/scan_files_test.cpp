#include "gateway/scan_files.h"

#include <filesystem>

#include <gtest/gtest.h>

#include "gateway/config/plant.h"
#include "gateway/found_nodes.h"
#include "stack/base/byte_order.h"

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

// What is reached by the domain and the access of the gateway that scanned is reached by the same
// when the written configuration runs.
TEST(ScanFiles, TheConfigurationHasDomainAndAccessOfTheLine) {
  const std::string folder = testing::TempDir() + "/scan-files";
  std::filesystem::remove_all(folder);
  const ScanFiles files = write_scan({.gateway = "lab",
                                      .name = "press",
                                      .interface_uri = "virtual:p",
                                      .access = "all",
                                      .dds_domain = 77,
                                      .nodes = {encoder_5()}},
                                     folder, "");
  ASSERT_TRUE(files.ok) << files.error;
  const auto loaded = config::load(folder + "/plant.yaml");
  ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.at(0));
  EXPECT_EQ(loaded.value->dds_domain, 77U);
  EXPECT_EQ(loaded.value->lines[0].commands, config::Access::all);
  EXPECT_EQ(loaded.value->lines[0].outputs, config::Access::read) << "nobody knows more";
  ASSERT_EQ(loaded.value->lines[0].config.nodes.size(), 1U);
  EXPECT_FALSE(
      write_scan({.gateway = "lab", .name = "press", .interface_uri = "virtual:p"}, folder, "").ok)
      << "nothing is overwritten";
  std::filesystem::remove_all(folder);
}

// It was made by somebody who keeps the files of each device in a folder of its name.
TEST(ScanFiles, AFolderNamedAsAnEdsIsNone) {
  const std::string folder = testing::TempDir() + "/scan-folder-of-eds";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder + "/encoder.eds");
  const std::vector<scan::ScannedNode> nodes{encoder_5()};
  const FoundNodes found = found_nodes(nodes, folder);
  EXPECT_EQ(found.error, "");
  ASSERT_EQ(found.nodes.size(), 1U);
  EXPECT_EQ(found.nodes[0].sheet, "");
  std::filesystem::remove_all(folder);
}

TEST(ScanFiles, AnEdsThatFailsWhileItIsReadIsNamed) {
  const std::string folder = testing::TempDir() + "/scan-eds-on-a-bad-disk";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  std::filesystem::create_symlink("/proc/self/mem", folder + "/encoder.eds");  // gives EIO
  const std::vector<scan::ScannedNode> nodes{encoder_5()};
  EXPECT_EQ(found_nodes(nodes, folder).error, folder + "/encoder.eds: cannot be read");
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace linegate::gateway
