// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/pdo/described_cob_id.h"
#include "stack/pdo/parameters.h"

#include "tests/stack/pdo/devices.h"

namespace linegate::pdo {
namespace {

using namespace test;
using testing::AllOf;
using testing::HasSubstr;

od::DeviceDescription device_with(const Pdo& tpdo) {
  od::DeviceDescription device;
  device.file = "drive.eds";
  device.objects.push_back(value(0x6041, DataType::unsigned16, Access::ro));
  device.objects.push_back(value(0x6040, DataType::unsigned16, Access::rww));
  device.objects.push_back(value(0x6042, DataType::integer32, Access::wo));
  add_tpdo(device, tpdo);
  return sorted(device);
}

TEST(DescribePdos, GivesWhatTheRecordsSay) {
  od::DeviceDescription device = device_with({.number = 3,
                                              .cob_id = 0x381,
                                              .type = 10,
                                              .inhibit = 25,
                                              .event_timer = 500,
                                              .sync_start = 4,
                                              .mapping = {0x60410010}});
  add_rpdo(device, {.cob_id = 0x40000201, .mapping = {0x60400010, 0x00050008}});
  const Loaded<DevicePdos> pdos = describe_pdos(sorted(device));
  ASSERT_TRUE(pdos.ok());
  EXPECT_TRUE(pdos.diagnostics.empty());
  ASSERT_EQ(pdos.value->tpdos.size(), 1U);
  const Parameters& tpdo = pdos.value->tpdos[0];
  EXPECT_EQ(tpdo.number, 3);
  EXPECT_EQ(tpdo.cob_id.id(), 0x381U);
  EXPECT_EQ(tpdo.type, 10);
  EXPECT_EQ(tpdo.inhibit, std::chrono::microseconds(2500));
  EXPECT_EQ(tpdo.event_timer, std::chrono::milliseconds(500));
  EXPECT_EQ(tpdo.sync_start, 4);
  ASSERT_EQ(tpdo.mapping.size(), 1U);
  EXPECT_EQ(tpdo.mapping[0].raw(), 0x60410010U);
  ASSERT_EQ(pdos.value->rpdos.size(), 1U);
  EXPECT_EQ(pdos.value->rpdos[0].mapping.size(), 2U) << "the dummy entry is kept";
}

TEST(DescribePdos, LeavesOutWhatDoesNotExist) {
  EXPECT_TRUE(describe_pdos(device_with({.cob_id = 0x80000181, .mapping = {0x12340010}}))
                  .value->tpdos.empty());
  EXPECT_TRUE(describe_pdos(device_with({.cob_id = 0x181})).value->tpdos.empty());
  EXPECT_TRUE(describe_pdos(od::DeviceDescription{}).value->tpdos.empty());
}

struct Wrong {
  const char* what;
  Pdo pdo;
  Severity severity;
  const char* text;
  std::uint16_t object;  // the object whose line is named
};

class DescribeWrong : public testing::TestWithParam<Wrong> {};

TEST_P(DescribeWrong, IsToldWithFileAndLine) {
  const Wrong& wrong = GetParam();
  const Loaded<DevicePdos> pdos = describe_pdos(device_with(wrong.pdo));
  ASSERT_EQ(pdos.diagnostics.size(), 1U);
  EXPECT_EQ(pdos.diagnostics[0].severity, Severity::warning);
  EXPECT_EQ(pdos.diagnostics[0].file, "drive.eds");
  EXPECT_EQ(pdos.diagnostics[0].line, 100U + wrong.object);
  EXPECT_THAT(pdos.diagnostics[0].text, HasSubstr(wrong.text));
  EXPECT_THAT(pdos.diagnostics[0].text, HasSubstr("TPDO 1"));
  ASSERT_TRUE(pdos.ok());
  EXPECT_EQ(pdos.value->tpdos.empty(), wrong.severity == Severity::error);
}

// A configured value cannot be ignored.
TEST_P(DescribeWrong, IsAnErrorOnceItIsConfigured) {
  const Wrong& wrong = GetParam();
  for (const bool in_file : {true, false}) {
    od::DeviceDescription device = device_with(wrong.pdo);
    for (od::ObjectDescription& object : device.objects) {
      if (object.index == 0x1A00) {
        object.variables[0].configured = in_file;
        object.variables[0].overridden = !in_file;
      }
    }
    const Loaded<DevicePdos> pdos = describe_pdos(device);
    ASSERT_EQ(pdos.diagnostics.size(), 1U);
    EXPECT_EQ(pdos.diagnostics[0].severity, wrong.severity);
    EXPECT_THAT(pdos.diagnostics[0].text, HasSubstr(wrong.text));
    EXPECT_EQ(pdos.ok(), wrong.severity != Severity::error);
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, DescribeWrong,
    testing::Values(Wrong{"missing object",
                          {.cob_id = 0x181, .mapping = {0x20000108}},
                          Severity::error,
                          "2000:01, which does not exist",
                          0x1A00},
                    Wrong{"length",
                          {.cob_id = 0x181, .mapping = {0x60410020}},
                          Severity::error,
                          "6041:00 with 32 bits, but it is UNSIGNED16",
                          0x1A00},
                    Wrong{"too long",
                          {.cob_id = 0x181,
                           .mapping = {0x60410010, 0x60410010, 0x60410010, 0x60410010, 0x60410010}},
                          Severity::error,
                          "80 bits, more than 64",
                          0x1A00},
                    Wrong{"too many",
                          {.cob_id = 0x181, .mapping = std::vector<std::uint32_t>(65, 0x00010001)},
                          Severity::error,
                          "65 objects, more than 64",
                          0x1A00},
                    Wrong{"not mappable",
                          {.cob_id = 0x181, .mapping = {0x18000208}},
                          Severity::warning,
                          "PDOMapping=0",
                          0x1A00},
                    Wrong{"direction",
                          {.cob_id = 0x181, .mapping = {0x60400010}},
                          Severity::warning,
                          "access type",
                          0x1A00},
                    Wrong{"reserved",
                          {.cob_id = 0x601, .mapping = {0x60410010}},
                          Severity::error,
                          "COB-ID 601h is reserved",
                          0x1800}),
    [](const auto& which) {
      std::string name = which.param.what;
      std::ranges::replace(name, ' ', '_');
      return name;
    });

TEST(DescribePdos, CountsMoreEntriesThanThereAre) {
  od::DeviceDescription device = device_with({.cob_id = 0x181, .mapping = {0x60410010}, .room = 1});
  for (od::ObjectDescription& object : device.objects) {
    if (object.index == 0x1A00) {
      object.variables[0].value = {std::byte{2}};
    }
  }
  const Loaded<DevicePdos> pdos = describe_pdos(device);
  ASSERT_TRUE(pdos.ok());
  EXPECT_TRUE(pdos.value->tpdos.empty());
  ASSERT_EQ(pdos.diagnostics.size(), 1U);
  EXPECT_THAT(pdos.diagnostics[0].text, HasSubstr("entry 2 is counted but has no value"));
  EXPECT_EQ(pdos.diagnostics[0].line, 100U + 0x1A00U);
}

TEST(DescribePdos, LeavesOutMultiplexedPdos) {
  od::DeviceDescription device = device_with({.cob_id = 0x181, .mapping = {0x60410010}});
  for (od::ObjectDescription& object : device.objects) {
    if (object.index == 0x1A00) {
      object.variables[0].value = {std::byte{0xFF}};
    }
  }
  const Loaded<DevicePdos> pdos = describe_pdos(device);
  ASSERT_TRUE(pdos.ok());
  EXPECT_TRUE(pdos.value->tpdos.empty());
  EXPECT_EQ(pdos.diagnostics.size(), 1U);
}

TEST(DescribePdos, CanFdAllowsMore) {
  const od::DeviceDescription device =
      device_with({.cob_id = 0x181, .mapping = std::vector<std::uint32_t>(5, 0x60410010)});
  EXPECT_TRUE(describe_pdos(device).value->tpdos.empty());
  EXPECT_EQ(describe_pdos(device, 512).value->tpdos.size(), 1U);
}

// Sixty-four entries of 0000h, as an EDS editor writes them for an unused PDO.
TEST(DescribePdos, MappingDefaultsThatMakeNoSenseAreOneWarning) {
  od::DeviceDescription device =
      device_with({.cob_id = 0x181, .mapping = std::vector<std::uint32_t>(64, 0)});
  add_tpdo(device, {.number = 2, .cob_id = 0x281, .mapping = {0x60410010}});
  const Loaded<DevicePdos> pdos = describe_pdos(sorted(device));
  ASSERT_TRUE(pdos.ok());
  ASSERT_EQ(pdos.diagnostics.size(), 1U);
  EXPECT_THAT(pdos.diagnostics[0].text,
              AllOf(HasSubstr("(and 63 more of this PDO)"), HasSubstr("pdos:")));
  ASSERT_EQ(pdos.value->tpdos.size(), 1U);
  EXPECT_EQ(pdos.value->tpdos[0].number, 2);
}

TEST(DescribePdos, ABooleanMayBeMappedAsAByte) {
  od::DeviceDescription device = device_with({.cob_id = 0x181, .mapping = {0x20000008}});
  device.objects.push_back(value(0x2000, DataType::boolean, Access::ro));
  const Loaded<DevicePdos> pdos = describe_pdos(sorted(device));
  ASSERT_TRUE(pdos.ok());
  ASSERT_EQ(pdos.diagnostics.size(), 1U);
  EXPECT_EQ(pdos.diagnostics[0].severity, Severity::warning);
  EXPECT_THAT(pdos.diagnostics[0].text, HasSubstr("the lowest bit is its value"));
  ASSERT_EQ(pdos.value->tpdos.size(), 1U);
  EXPECT_EQ(pdos.value->tpdos[0].mapping[0].bits, 8);
}

// A file without DefaultValue in 1800h:1, for each PDO and each node-ID.
TEST(DescribedCobId, IsThatOfThePredefinedConnectionSetWhereTheFileGivesNone) {
  for (const std::vector<std::byte>& none :
       {std::vector<std::byte>{}, std::vector<std::byte>(4, std::byte{0})}) {
    for (std::uint16_t number = 1; number <= 6; ++number) {
      od::DeviceDescription device;
      device.node_id = 9;
      add_tpdo(device, {.number = number, .cob_id = 0});
      add_rpdo(device, {.number = number, .cob_id = 0});
      device = sorted(device);
      for (od::ObjectDescription& object : device.objects) {
        object.variables[1].value = none;
      }
      const bool predefined = number <= 4;
      const can::CobId sent = described_cob_id(device, PdoKind::tpdo, number);
      const can::CobId received = described_cob_id(device, PdoKind::rpdo, number);
      EXPECT_EQ(sent.valid(), predefined);
      EXPECT_EQ(received.valid(), predefined);
      if (predefined) {
        EXPECT_EQ(sent.raw, 0x89U + number * 0x100U);
        EXPECT_EQ(received.raw, 0x109U + number * 0x100U);
      }
      complete_cob_ids(device);
      EXPECT_EQ(described_cob_id(device, PdoKind::tpdo, number), sent);
      const od::VariableDescription* cob_id =
          device.find(od::Address{static_cast<std::uint16_t>(0x1800 + number - 1), 1});
      EXPECT_EQ(cob_id->notes.value_formula, predefined);
      device.node_id = 0;
      if (!predefined) {
        EXPECT_FALSE(described_cob_id(device, PdoKind::tpdo, number).valid());
      }
    }
  }
}

TEST(DescribedCobId, IsWhatTheFileSaysOtherwise) {
  od::DeviceDescription device;
  device.node_id = 9;
  add_tpdo(device, {.number = 1, .cob_id = 0x4000'01C5});
  add_tpdo(device, {.number = 2, .cob_id = 0x8000'0000});
  add_tpdo(device, {.number = 3, .cob_id = 0x2000'0000});
  add_tpdo(device, {.number = 4, .cob_id = 0x4000'0000});
  device = sorted(device);
  EXPECT_EQ(described_cob_id(device, PdoKind::tpdo, 1).raw, 0x4000'01C5U);
  EXPECT_EQ(described_cob_id(device, PdoKind::tpdo, 2).raw, 0x8000'0000U);
  EXPECT_EQ(described_cob_id(device, PdoKind::tpdo, 3).raw, 0x2000'0000U) << "29 bits";
  EXPECT_EQ(described_cob_id(device, PdoKind::tpdo, 4).raw, 0x4000'0489U) << "without RTR";
  EXPECT_FALSE(described_cob_id(device, PdoKind::tpdo, 5).valid()) << "the PDO does not exist";
}

}  // namespace
}  // namespace linegate::pdo
