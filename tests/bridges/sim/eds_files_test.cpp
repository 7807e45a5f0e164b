// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "bridges/sim/device.h"
#include "stack/base/byte_order.h"
#include "stack/eds/reader.h"
#include "stack/od/objects.h"
#include "stack/pdo/parameters.h"

namespace linegate::sim {
namespace {

std::string all(const std::vector<Diagnostic>& diagnostics) {
  std::string text;
  for (const Diagnostic& d : diagnostics) {
    text += to_string(d) + "\n";
  }
  return text;
}

class EdsFile : public testing::TestWithParam<std::string_view> {};

TEST_P(EdsFile, LoadsWithoutAnyDiagnostic) {
  for (const std::uint8_t node : std::initializer_list<std::uint8_t>{1, 42, 127}) {
    const auto device = eds::load(eds_text(GetParam()), eds_name(GetParam()), node);
    ASSERT_TRUE(device.ok()) << all(device.diagnostics);
    EXPECT_TRUE(device.diagnostics.empty()) << all(device.diagnostics);
  }
}

TEST_P(EdsFile, EveryPdoIsMappedWithoutAnyDiagnostic) {
  const auto device = eds::load(eds_text(GetParam()), eds_name(GetParam()), 5);
  ASSERT_TRUE(device.ok());
  const bool fd = GetParam() == "fd-io";
  const auto pdos = pdo::describe_pdos(*device.value, fd ? 512 : 64);
  ASSERT_TRUE(pdos.ok()) << all(pdos.diagnostics);
  EXPECT_TRUE(pdos.diagnostics.empty()) << all(pdos.diagnostics);
  EXPECT_EQ(pdos.value->tpdos.size(), fd ? 1U : 2U);
  for (const auto& tpdo : pdos.value->tpdos) {
    EXPECT_EQ(tpdo.cob_id.id(), 0x185U + 0x100U * (tpdo.number - 1U));
  }
}

TEST_P(EdsFile, HasTheObjectsAManagerAsksFor) {
  const auto device = eds::load(eds_text(GetParam()), eds_name(GetParam()), 5);
  ASSERT_TRUE(device.ok());
  for (const std::uint16_t index : std::initializer_list<std::uint16_t>{
           0x1000, 0x1001, 0x1003, 0x1005, 0x1014, 0x1015, 0x1016, 0x1017, 0x1018}) {
    EXPECT_NE(device.value->find(index), nullptr) << std::hex << index;
  }
  EXPECT_EQ(device.value->find(0x1200) == nullptr, GetParam() == "fd-io");
}

TEST_P(EdsFile, ItsObjectsHaveTheTypesOfTheCatalogue) {
  const auto device = eds::load(eds_text(GetParam()), eds_name(GetParam()), 5);
  ASSERT_TRUE(device.ok());
  const std::vector<std::byte>& device_type =
      device.value->find(od::Address{od::objects::kDeviceType, 0})->value;
  const auto profile =
      static_cast<std::uint16_t>(load_le(std::span<const std::byte>(device_type).first(2)));
  ASSERT_FALSE(od::objects::all(profile).empty());
  unsigned known = 0;
  for (const od::ObjectDescription& object : device.value->objects) {
    const od::objects::Entry* entry = od::objects::find(object.index);
    entry = entry != nullptr ? entry : od::objects::find(object.index, profile);
    if (entry == nullptr) {
      continue;
    }
    ++known;
    EXPECT_EQ(object.type, entry->object) << entry->name;
    if (entry->object != od::ObjectType::record) {
      EXPECT_EQ(object.variables.back().type, entry->type) << entry->name;
    }
  }
  EXPECT_GT(known, 20U);
}

INSTANTIATE_TEST_SUITE_P(All, EdsFile, testing::ValuesIn(profiles().begin(), profiles().end()));

TEST(EdsFiles, UnknownProfileHasNone) {
  EXPECT_TRUE(eds_text("toaster").empty());
  EXPECT_TRUE(eds_name("toaster").empty());
}

}  // namespace
}  // namespace linegate::sim
