// SPDX-License-Identifier: Apache-2.0
// The configuration of a node in addition to its device file: restore, store, and a concise DCF.
#include <algorithm>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/config/plant.h"
#include "stack/line/build.h"
#include "stack/line/line.h"
#include "stack/manager/plan.h"

#include "tests/paths.h"

namespace linegate::config {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const std::string kEds = paths::in_repository("bridges/sim/eds/drive.eds");

class Configuration : public testing::Test {
 protected:
  Configuration() : folder_(testing::TempDir() + "linegate_configuration_" + test_name()) {
    std::filesystem::create_directories(folder_);
  }
  ~Configuration() override { std::filesystem::remove_all(folder_); }

  static std::string test_name() {
    return testing::UnitTest::GetInstance()->current_test_info()->name();
  }
  void write(const std::string& name, const std::vector<manager::ObjectWrite>& writes,
             std::size_t cut = 0) const {
    const auto bytes = manager::write_concise_dcf(writes);
    std::ofstream(folder_ + "/" + name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size() - cut));
  }
  // A plant with one drive and these keys of its node.
  Loaded<Plant> plant(const std::string& keys) const {
    return read(
        "schema: 1\nlines:\n  - name: press\n    interface: \"simulated:\"\n    nodes:\n"
        "      - id: 5\n        name: x\n        eds: " +
            kEds + "\n" + keys,
        folder_ + "/plant.yaml");
  }
  static std::vector<std::string> messages(const Loaded<Plant>& loaded) {
    std::vector<std::string> out;
    for (const auto& diagnostic : loaded.diagnostics) {
      out.push_back(std::to_string(diagnostic.line) + ": " + diagnostic.text);
    }
    return out;
  }
  static manager::NodePlan plan_of(const Loaded<Plant>& loaded) {
    return line::node_plans(loaded.value->lines.at(0).config).at(0);
  }

  std::string folder_;
};

std::vector<std::byte> u32(std::uint32_t value) {
  return {std::byte(value), std::byte(value >> 8U), std::byte(value >> 16U),
          std::byte(value >> 24U)};
}

TEST_F(Configuration, StoreAndRestoreAreGroupsOfParameters) {
  const auto words = plant("        restore: application\n        store: all\n");
  ASSERT_TRUE(words.ok());
  EXPECT_EQ(plan_of(words).restore, 3);
  EXPECT_EQ(plan_of(words).store, 1);
  EXPECT_TRUE(plan_of(words).expected.known()) << "the stored configuration has a date";
  const auto numbers = plant("        restore: 127\n");
  ASSERT_TRUE(numbers.ok());
  EXPECT_EQ(plan_of(numbers).restore, 127);
  EXPECT_FALSE(plan_of(numbers).expected.known());
  for (const char* wrong : {"some", "0", "128", "[1]"}) {
    EXPECT_THAT(messages(plant(std::string("        store: ") + wrong + "\n")),
                ElementsAre("9: expected all, communication, application, manufacturer or a "
                            "sub-index 1..127"))
        << wrong;
  }
}

TEST_F(Configuration, AConciseDcfTakesThePlaceOfTheDeviceFile) {
  write("x.cdc", {{{0x1800, 1}, u32(0x8000'0185)},
                  {{0x1A00, 0}, {std::byte{0}}},
                  {{0x1A00, 1}, u32(0x6064'0020)},
                  {{0x1A00, 0}, {std::byte{1}}},
                  {{0x1800, 1}, u32(0x185)},
                  {{0x1020, 1}, u32(15'000)},
                  {{0x1020, 2}, u32(77)}});
  const auto loaded = plant("        concise_dcf: x.cdc\n        heartbeat: 100ms\n");
  ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.at(0));
  EXPECT_TRUE(loaded.diagnostics.empty());
  const manager::NodePlan plan = plan_of(loaded);
  ASSERT_EQ(plan.writes.size(), 8U) << "including the heartbeat time";
  EXPECT_EQ(plan.writes[0].address, (od::Address{0x1800, 1}));
  EXPECT_EQ(plan.writes[5].address, (od::Address{0x1017, 0}));
  EXPECT_EQ(plan.writes[7].address, (od::Address{0x1020, 2})) << "the date is written last";
  EXPECT_EQ(plan.expected, (manager::ConfigurationDate{.date = 15'000, .time = 77}));
  const auto line = line::Line::make(loaded.value->lines.at(0).config);
  ASSERT_TRUE(line.ok());
  const auto& entries = (*line.value)->layout(image::Direction::inputs).entries;
  const auto of_first = std::ranges::count(entries, 1, &image::Entry::remote_pdo);
  EXPECT_EQ(of_first, 1) << "its first TPDO has one object now";
}

TEST_F(Configuration, AProgramIsVerifiedOrUpdated) {
  std::ofstream(folder_ + "/x.bin", std::ios::binary) << "1234";
  std::ofstream(folder_ + "/empty.bin", std::ios::binary) << "";
  const auto verified = plant("        program: {identification: 0x10002}\n");
  ASSERT_TRUE(verified.ok());
  EXPECT_EQ(plan_of(verified).software, 0x10002U);
  EXPECT_FALSE(plan_of(verified).update_software);
  const auto updated = plant("        program: {identification: 1, file: x.bin, update: true}\n");
  ASSERT_TRUE(updated.ok());
  EXPECT_TRUE(plan_of(updated).update_software);
  EXPECT_EQ(plan_of(updated).program->size(), 4U);
  EXPECT_THAT(messages(plant("        program: {identification: 1, update: true}\n")),
              ElementsAre("9: a program that may be updated needs the key \"file\""));
  EXPECT_THAT(messages(plant("        program: {file: x.bin}\n")),
              ElementsAre("9: a program needs the key \"identification\""));
  EXPECT_THAT(messages(plant("        program: {identification: 1, file: empty.bin}\n")),
              ElementsAre(HasSubstr("empty.bin has 0 bytes; a program has 1 to 16777216")));
  EXPECT_THAT(messages(plant("        program: {identification: 1, file: none.bin}\n")),
              ElementsAre(HasSubstr("there is no file")));
}

TEST_F(Configuration, WhatIsNoConciseDcfIsToldWithItsPlace) {
  write("cut.cdc", {{{0x6081, 0}, u32(1)}}, 1);
  write("other.cdc", {{{0x7FFF, 1}, u32(1)}});
  EXPECT_THAT(messages(plant("        concise_dcf: none.cdc\n")),
              ElementsAre(HasSubstr("9: there is no file " + folder_ + "/none.cdc")));
  EXPECT_THAT(messages(plant("        concise_dcf: cut.cdc\n")),
              ElementsAre(HasSubstr("cut.cdc is no concise DCF: its 14 bytes do not match its "
                                    "count and sizes")));
  const auto unknown = plant("        concise_dcf: other.cdc\n");
  EXPECT_TRUE(unknown.ok());
  EXPECT_THAT(messages(unknown), ElementsAre(HasSubstr("the concise DCF writes to 7FFF:01")));
}

// Documented in the operator's guide.
TEST_F(Configuration, TheConciseDcfTakesThePlaceOfObjectsAndPdos) {
  write("one.cdc", {{{0x6081, 0}, u32(1)}});
  const auto loaded = plant(
      "        concise_dcf: one.cdc\n        objects: {6081: 5, 6083: 7}\n"
      "        pdos: {tpdo1: {enabled: false}}\n");
  ASSERT_TRUE(loaded.ok());
  EXPECT_THAT(messages(loaded), ElementsAre(HasSubstr("objects has no effect beside concise_dcf"),
                                            HasSubstr("pdos has no effect beside concise_dcf")));
  const auto& objects = loaded.value->lines[0].config.nodes[0].objects;
  ASSERT_EQ(objects.size(), 1U);
  EXPECT_EQ(objects[0].address, (od::Address{0x6081, 0}));
  EXPECT_EQ(objects[0].data, u32(1));
}

}  // namespace
}  // namespace linegate::config
