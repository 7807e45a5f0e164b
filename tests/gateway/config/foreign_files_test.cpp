// SPDX-License-Identifier: Apache-2.0
// Device files from other tools: their omissions and their errors.
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/config/plant.h"
#include "stack/base/byte_order.h"
#include "stack/line/build.h"
#include "stack/line/line.h"
#include "stack/od/dictionary.h"

namespace linegate::config {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

class ForeignFile : public testing::Test {
 protected:
  ForeignFile() : folder_(testing::TempDir() + "linegate_foreign_" + test_name()) {
    std::filesystem::create_directories(folder_);
  }
  ~ForeignFile() override { std::filesystem::remove_all(folder_); }

  static std::string test_name() {
    return testing::UnitTest::GetInstance()->current_test_info()->name();
  }
  void write(const std::string& content) const {
    std::ofstream(folder_ + "/x.eds", std::ios::binary) << content;
  }
  // A plant with one node, node-ID 5, with its device file and these keys.
  Loaded<Plant> plant(const std::string& keys = "") const {
    return read(
        "schema: 1\nlines:\n  - name: press\n    interface: \"simulated:\"\n    nodes:\n"
        "      - id: 5\n        name: x\n        eds: x.eds\n" +
            (keys.empty() ? keys : "        " + keys + "\n"),
        folder_ + "/plant.yaml");
  }
  static std::string messages(const Loaded<Plant>& loaded) {
    std::string out;
    for (const auto& diagnostic : loaded.diagnostics) {
      out += to_string(diagnostic) + '\n';
    }
    return out;
  }
  // The values that are written to the COB-ID of a PDO, in order.
  static std::vector<std::uint32_t> cob_ids(const Loaded<Plant>& loaded, std::uint16_t record) {
    std::vector<std::uint32_t> out;
    const auto plans = line::node_plans(loaded.value->lines.at(0).config);
    for (const auto& write : plans.at(0).writes) {
      if (write.address == od::Address{record, 1}) {
        out.push_back(load_le<std::uint32_t>(write.data.data()));
      }
    }
    return out;
  }

  std::string folder_;
};

std::string section(const std::string& name, const std::string& lines) {
  return "[" + name + "]\n" + lines;
}

std::string var(const std::string& place, const std::string& name, int type,
                const std::string& access, const std::string& rest = "") {
  return section(place, "ParameterName=" + name + "\nObjectType=7\nDataType=" +
                            std::to_string(type) + "\nAccessType=" + access + "\n" + rest);
}

std::string rec(const std::string& index, const std::string& name, int subs) {
  return section(
      index, "ParameterName=" + name + "\nObjectType=9\nSubNumber=" + std::to_string(subs) + "\n");
}

// An EDS with one TPDO that has these lines for its COB-ID, transmission type and mapping.
std::string eds(const std::string& cob_id, const std::string& type, const std::string& mapping,
                int entries, const std::string& number = "0") {
  return "[FileInfo]\n[DeviceInfo]\n[MandatoryObjects]\nSupportedObjects=1\n1=0x1000\n"
         "[OptionalObjects]\nSupportedObjects=5\n1=0x180" +
         number + "\n2=0x1A0" + number + "\n3=0x2000\n4=0x2001\n5=0x2002\n" +
         var("1000", "Device type", 7, "ro") + rec("180" + number, "TPDO", 3) +
         var("180" + number + "sub0", "Count", 5, "ro", "DefaultValue=2\n") +
         var("180" + number + "sub1", "COB-ID", 7, "rw", cob_id) +
         var("180" + number + "sub2", "Type", 5, "rw", type) +
         rec("1A0" + number, "TPDO mapping", entries + 1) +
         var("1A0" + number + "sub0", "Count", 5, "rw",
             "DefaultValue=" + std::to_string(entries) + "\n") +
         mapping + var("2000", "Flag", 1, "rw", "PDOMapping=1\n") +
         var("2001", "Level", 6, "rw", "PDOMapping=1\nLowLimit=10\nHighLimit=100\n") +
         var("2002", "Offset", 3, "rw", "LowLimit=-5\nHighLimit=5\n");
}

std::string entry(const std::string& place, const std::string& value) {
  return var(place, "Entry", 7, "rw", "DefaultValue=" + value + "\n");
}

TEST_F(ForeignFile, WithoutACobIdHasThePdosOfThePredefinedConnectionSet) {
  write(eds("", "DefaultValue=255\n", entry("1A00sub1", "0x20010010"), 1));
  const auto plain = plant();
  ASSERT_TRUE(plain.ok()) << messages(plain);
  const auto made = line::Line::make(plain.value->lines.at(0).config);
  ASSERT_TRUE(made.ok());
  ASSERT_EQ((*made.value)->layout(image::Direction::inputs).entries.size(), 1U);
  EXPECT_EQ((*made.value)->dictionary().number({0x1400, 1}), 0x185U);

  for (const char* keys : {"objects: {1800:2: 1}", "pdos: {tpdo1: {type: 1}}"}) {
    const auto changed = plant(keys);
    ASSERT_TRUE(changed.ok()) << messages(changed);
    for (const std::uint32_t cob_id : cob_ids(changed, 0x1800)) {
      EXPECT_EQ(cob_id & 0x7FFU, 0x185U) << keys;
    }
  }
}

TEST_F(ForeignFile, WithAConfiguredTypeAndNoCobIdIsWrittenAsTheRuleSays) {
  write(eds("", "DefaultValue=255\nParameterValue=1\n", entry("1A00sub1", "0x20010010"), 1));
  std::filesystem::rename(folder_ + "/x.eds", folder_ + "/x.dcf");
  const auto loaded = read(
      "schema: 1\nlines:\n  - name: press\n    interface: \"simulated:\"\n    nodes:\n"
      "      - {id: 5, name: x, dcf: x.dcf}\n",
      folder_ + "/plant.yaml");
  ASSERT_TRUE(loaded.ok()) << messages(loaded);
  EXPECT_EQ(cob_ids(loaded, 0x1800), (std::vector<std::uint32_t>{0x8000'0185, 0x185}));
}

TEST_F(ForeignFile, ACobIdThatMustNotBeValidIsAnError) {
  write(eds("DefaultValue=$NODEID+0x180\n", "DefaultValue=255\n", entry("1A00sub1", "0x20010010"),
            1));
  for (const char* value : {"0", "0x7F", "0x40000000", "0x701", "0x101"}) {
    const auto loaded = plant("objects: {1800:1: " + std::string(value) + "}");
    EXPECT_FALSE(loaded.ok()) << value;
    EXPECT_THAT(messages(loaded), HasSubstr("plant.yaml:9:27: error: object 1800:01")) << value;
  }
  EXPECT_TRUE(plant("objects: {1800:1: 0x80000000}").ok());
}

TEST_F(ForeignFile, APdoWithoutCobIdMayBeDisabled) {
  write(eds("", "DefaultValue=255\n", entry("1A06sub1", "0x20010010"), 1, "6"));
  const auto loaded = plant("pdos: {tpdo7: {enabled: false}}");
  ASSERT_TRUE(loaded.ok()) << messages(loaded);
  EXPECT_EQ(cob_ids(loaded, 0x1806), (std::vector<std::uint32_t>{0x8000'0000})) << "written once";
  EXPECT_THAT(messages(plant("pdos: {tpdo7: {type: 1}}")), HasSubstr("cob_id is needed"));
}

TEST_F(ForeignFile, MappingDefaultsThatMakeNoSenseLeaveThatPdoOut) {
  std::string mapping;
  for (int sub = 1; sub <= 64; ++sub) {
    char place[16];
    std::snprintf(place, sizeof place, "1A00sub%X", static_cast<unsigned>(sub));
    mapping += entry(place, "0");
  }
  write(eds("DefaultValue=$NODEID+0x180\n", "DefaultValue=255\n", mapping, 64));
  const auto loaded = plant();
  ASSERT_TRUE(loaded.ok()) << messages(loaded);
  ASSERT_EQ(loaded.diagnostics.size(), 1U) << messages(loaded);
  EXPECT_THAT(messages(loaded), AllOf(HasSubstr("warning"), HasSubstr("pdos:")));
  const auto mapped = plant("pdos: {tpdo1: {map: [2001]}}");
  ASSERT_TRUE(mapped.ok()) << messages(mapped);
  EXPECT_THAT(messages(mapped), IsEmpty());
  EXPECT_FALSE(plant("pdos: {tpdo1: {type: 1}}").ok())
      << "a transmission type needs a valid mapping";
}

TEST_F(ForeignFile, ABooleanInAByteIsOneBitOfTheImage) {
  write(eds("DefaultValue=$NODEID+0x180\n", "DefaultValue=255\n",
            entry("1A00sub1", "0x20000008") + entry("1A00sub2", "0x20010010"), 2));
  const auto loaded = plant();
  ASSERT_TRUE(loaded.ok()) << messages(loaded);
  EXPECT_THAT(messages(loaded), HasSubstr("the lowest bit is its value"));
  const auto made = line::Line::make(loaded.value->lines.at(0).config);
  ASSERT_TRUE(made.ok());
  const auto& entries = (*made.value)->layout(image::Direction::inputs).entries;
  ASSERT_EQ(entries.size(), 2U);
  EXPECT_EQ(entries[0].bit_length, 1U);
}

// As in the EDS of CANopenNode: all elements of 6200h have the same name.
TEST_F(ForeignFile, ElementsOfOneNameAreTwoEntriesWithTheirSubIndices) {
  std::string text = eds("DefaultValue=$NODEID+0x180\n", "DefaultValue=255\n",
                         entry("1A00sub1", "0x60000108") + entry("1A00sub2", "0x60000208"), 2);
  text.replace(text.find("SupportedObjects=5"), 18, "SupportedObjects=6\n6=0x6000");
  text += rec("6000", "Write output", 3) + var("6000sub0", "Count", 5, "ro", "DefaultValue=2\n") +
          var("6000sub1", "Output", 5, "rw", "PDOMapping=1\n") +
          var("6000sub2", "Output", 5, "rw", "PDOMapping=1\n");
  write(text);
  const auto loaded = plant();
  ASSERT_TRUE(loaded.ok()) << messages(loaded);
  const auto made = line::Line::make(loaded.value->lines.at(0).config);
  ASSERT_TRUE(made.ok());
  const auto& entries = (*made.value)->layout(image::Direction::inputs).entries;
  ASSERT_EQ(entries.size(), 2U);
  EXPECT_EQ(entries[0].name, "x.Write output.Output 01");
  EXPECT_EQ(entries[1].name, "x.Write output.Output 02");
}

TEST_F(ForeignFile, AnObjectBeyondItsLimitsIsAFinding) {
  write(eds("DefaultValue=$NODEID+0x180\n", "DefaultValue=255\n", entry("1A00sub1", "0x20010010"),
            1));
  for (const char* good : {"{2001: 10}", "{2001: 100}", "{2002: -5}", "{2002: 5}", "{2000: 1}"}) {
    const auto loaded = plant("objects: " + std::string(good));
    EXPECT_TRUE(loaded.ok()) << good << messages(loaded);
  }
  EXPECT_THAT(messages(plant("objects: {2001: 9}")),
              HasSubstr("plant.yaml:9:25: error: object 2001:00 (Level): the value is below the "
                        "LowLimit 0xA of the device file"));
  EXPECT_THAT(messages(plant("objects: {2001: 101}")), HasSubstr("above the HighLimit 0x64"));
  EXPECT_THAT(messages(plant("objects: {2002: -6}")), HasSubstr("below the LowLimit -5"));
  EXPECT_THAT(messages(plant("objects: {2002: 6}")), HasSubstr("above the HighLimit"));
}

TEST_F(ForeignFile, WhatOfItsIdentityIsComparedCanBeChosen) {
  std::string text = eds("", "DefaultValue=255\n", entry("1A00sub1", "0x20010010"), 1);
  text.replace(text.find("SupportedObjects=5"), 18, "SupportedObjects=6\n6=0x1018");
  text += rec("1018", "Identity", 4) + var("1018sub0", "Count", 5, "ro", "DefaultValue=3\n") +
          var("1018sub1", "Vendor", 7, "ro", "DefaultValue=1\n") +
          var("1018sub2", "Product", 7, "ro", "DefaultValue=2\n") +
          var("1018sub3", "Revision", 7, "ro", "DefaultValue=0x10002\n");
  write(text);
  const auto plan = [&](const std::string& keys) {
    const auto loaded = plant(keys);
    EXPECT_TRUE(loaded.ok()) << messages(loaded);
    return line::node_plans(loaded.value.value_or(Plant{.lines = {{}}}).lines.at(0).config).at(0);
  };
  const auto all = plan("");
  EXPECT_EQ(all.vendor, 1U);
  EXPECT_EQ(all.product, 2U);
  EXPECT_EQ(all.revision, 0x10002U);
  EXPECT_FALSE(all.revision_major_alone);
  const auto some = plan("check: [vendor, revision-major]");
  EXPECT_EQ(some.vendor, 1U);
  EXPECT_EQ(some.product, 0U);
  EXPECT_EQ(some.revision, 0x10002U);
  EXPECT_TRUE(some.revision_major_alone);
  EXPECT_FALSE(plan("check: [revision-major, revision]").revision_major_alone);
  EXPECT_FALSE(plan("check: [revision, revision-major]").revision_major_alone);
  const auto none = plan("check: []");
  EXPECT_EQ(none.vendor + none.product + none.revision + none.device_type, 0U);
  EXPECT_EQ(plan("check_identity: false").vendor, 0U);
  EXPECT_THAT(messages(plant("check: [vendor, serial]")),
              HasSubstr("expected device-type, vendor"));
  EXPECT_THAT(messages(plant("{check: [vendor], check_identity: true}")), HasSubstr("error"));
}

}  // namespace
}  // namespace linegate::config
