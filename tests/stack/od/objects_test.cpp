// SPDX-License-Identifier: Apache-2.0
// The catalogue: its order, and its entries compared with the tables of CiA 301, 302 and 401.
#include "stack/od/objects.h"

#include <set>

#include <gtest/gtest.h>

#include "stack/od/description.h"

namespace linegate::od {
namespace {

constexpr std::uint16_t kCommon = 0;

class CatalogueTest : public ::testing::TestWithParam<std::uint16_t> {};

TEST_P(CatalogueTest, IsOrderedWithoutOverlap) {
  std::uint32_t end = 0;
  for (const objects::Entry& entry : objects::all(GetParam())) {
    EXPECT_GE(entry.first, end) << entry.name;
    EXPECT_GE(entry.last, entry.first) << entry.name;
    end = entry.last + 1U;
  }
}

TEST_P(CatalogueTest, EveryEntryHasNameTypeAndSource) {
  for (const objects::Entry& entry : objects::all(GetParam())) {
    EXPECT_FALSE(entry.name.empty()) << entry.first;
    EXPECT_FALSE(entry.source.empty()) << entry.name;
    if (entry.object == ObjectType::record) {
      EXPECT_EQ(entry.type, DataType::none) << entry.name;
    } else {
      EXPECT_EQ(entry.structure, 0) << entry.name;
      const bool variables_of_each_type = entry.first >= objects::kInputVariables;
      EXPECT_EQ(entry.type == DataType::none, variables_of_each_type) << entry.name;
    }
  }
}

TEST_P(CatalogueTest, EveryIndexOfAnEntryIsFound) {
  for (const objects::Entry& entry : objects::all(GetParam())) {
    EXPECT_EQ(objects::find(entry.first, GetParam()), &entry);
    EXPECT_EQ(objects::find(entry.last, GetParam()), &entry);
  }
}

INSTANTIATE_TEST_SUITE_P(Profiles, CatalogueTest,
                         ::testing::Values(kCommon, objects::cia401::kProfile,
                                           objects::cia402::kProfile, objects::cia406::kProfile));

TEST(Catalogue, AreasEndWhereCia301Says) {
  struct Area {
    std::uint16_t first, last;
    std::uint16_t structure;
  };
  for (const Area area :
       {Area{0x1200, 0x127F, 0x22}, Area{0x1280, 0x12FF, 0x22}, Area{0x1400, 0x15FF, 0x20},
        Area{0x1600, 0x17FF, 0x21}, Area{0x1800, 0x19FF, 0x20}, Area{0x1A00, 0x1BFF, 0x21}}) {
    const objects::Entry& entry = objects::at(area.first);
    EXPECT_EQ(entry.first, area.first);
    EXPECT_EQ(entry.last, area.last);
    EXPECT_EQ(entry.structure, area.structure);
  }
  EXPECT_EQ(objects::at(0x1FA0).last, 0x1FCF);
  EXPECT_EQ(objects::at(0x1FD0).last, 0x1FFF);
  EXPECT_EQ(objects::at(0x1018).structure, 0x23);
  EXPECT_EQ(objects::at(0x1025).structure, 0x24);
  EXPECT_EQ(objects::at(0x1023).structure, 0x25);
}

TEST(Catalogue, RangesOfPdoRecords) {
  using namespace objects;
  for (unsigned index = 0x1300; index <= 0x1D00; ++index) {
    const auto i = static_cast<std::uint16_t>(index);
    const bool rpdo = i >= 0x1400 && i <= 0x15FF;
    const bool tpdo = i >= 0x1800 && i <= 0x19FF;
    const bool mapping = (i >= 0x1600 && i <= 0x17FF) || (i >= 0x1A00 && i <= 0x1BFF);
    EXPECT_EQ(is_rpdo_communication(i), rpdo) << index;
    EXPECT_EQ(is_tpdo_communication(i), tpdo) << index;
    EXPECT_EQ(is_pdo_communication(i), rpdo || tpdo) << index;
    EXPECT_EQ(is_pdo_mapping(i), mapping) << index;
    EXPECT_EQ(is_pdo_record(i), rpdo || tpdo || mapping) << index;
  }
}

TEST(Catalogue, DoesNotHaveWhatIsNotInIt) {
  for (const int index : {0x0005, 0x0FFF, 0x1004, 0x13FF, 0x1C00, 0x2000, 0x5F08, 0x6000, 0xC000}) {
    EXPECT_EQ(objects::find(static_cast<std::uint16_t>(index)), nullptr) << index;
  }
  EXPECT_EQ(objects::find(0x1000, objects::cia401::kProfile), nullptr);
  EXPECT_EQ(objects::find(0x6000, 408), nullptr) << "not in the catalogue";
}

TEST(Catalogue, VariablesTakeNameAndTypeOfIt) {
  const ObjectDescription made = catalogued_variable(0x1017, Access::rw, 0x0203);
  EXPECT_EQ(made.name, "Producer heartbeat time");
  ASSERT_EQ(made.variables.size(), 1U);
  EXPECT_EQ(made.variables[0].name, made.name);
  EXPECT_EQ(made.variables[0].type, DataType::unsigned16);
  EXPECT_EQ(made.variables[0].access, Access::rw);
  EXPECT_EQ(made.variables[0].value, (std::vector{std::byte{3}, std::byte{2}}));
}

TEST(Catalogue, IdentityHasItsFourNumbers) {
  const ObjectDescription made = identity_object(1, 2, 3, 4);
  ASSERT_EQ(made.variables.size(), 5U);
  for (std::uint8_t sub = 0; sub <= 4; ++sub) {
    EXPECT_EQ(made.variables[sub].sub, sub);
    EXPECT_EQ(made.variables[sub].value[0], std::byte{sub == 0 ? std::uint8_t{4} : sub});
  }
}

}  // namespace
}  // namespace linegate::od
