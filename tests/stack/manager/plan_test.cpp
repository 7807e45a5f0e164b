// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/plan.h"

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"
#include "stack/manager/state.h"

namespace linegate::manager {
namespace {

od::VariableDescription variable(std::uint8_t sub, od::DataType type, std::uint64_t value,
                                 bool configured, od::Access access = od::Access::rw) {
  od::VariableDescription out;
  out.sub = sub;
  out.type = type;
  out.access = access;
  out.value.resize(od::byte_size(type));
  store_le(std::span(out.value), value);
  out.configured = configured;
  return out;
}

od::ObjectDescription record(std::uint16_t index, std::vector<od::VariableDescription> variables) {
  return {.index = index,
          .name = "",
          .type = od::ObjectType::record,
          .variables = std::move(variables),
          .line = 0};
}

constexpr auto kU8 = od::DataType::unsigned8;
constexpr auto kU16 = od::DataType::unsigned16;
constexpr auto kU32 = od::DataType::unsigned32;

std::string text(const std::vector<ObjectWrite>& writes) {
  std::string out;
  for (const ObjectWrite& write : writes) {
    char line[64];
    std::snprintf(line, sizeof line, "%04X:%u=%llX ", unsigned{write.address.index},
                  unsigned{write.address.sub},
                  static_cast<unsigned long long>(load_le(std::span<const std::byte>(write.data))));
    out += line;
  }
  return out;
}

TEST(ConfigurationWrites, DefaultsAndReadOnlyObjectsAreLeftAlone) {
  od::DeviceDescription device;
  device.objects = {
      record(0x1017, {variable(0, kU16, 1000, true)}),
      record(0x2000, {variable(0, kU16, 7, false), variable(1, kU8, 5, true, od::Access::ro),
                      variable(2, kU8, 6, true)}),
  };
  EXPECT_EQ(text(configuration_writes(device)), "1017:0=3E8 2000:2=6 ");
}

TEST(ConfigurationWrites, ObjectsAreLeftAloneIfTheirFlagsSaySo) {
  od::DeviceDescription device;
  device.objects = {record(0x1010, {variable(0, kU8, 1, false), variable(1, kU32, 1, true)}),
                    record(0x2000, {variable(0, kU8, 1, true)})};
  device.objects[0].flags = 1;
  EXPECT_EQ(text(configuration_writes(device)), "2000:0=1 ");
}

TEST(ConfigurationWrites, PdoRecordsComeLastInTheOrderOfTheRemappingProcedure) {
  od::DeviceDescription device;
  device.objects = {
      record(0x1800, {variable(0, kU8, 5, false), variable(1, kU32, 0x185, false),
                      variable(2, kU8, 1, true), variable(5, kU16, 100, false)}),
      record(0x1A00, {variable(0, kU8, 2, true), variable(1, kU32, 0x60000108, true),
                      variable(2, kU32, 0x60000208, false), variable(3, kU32, 0x60000308, false)}),
      record(0x2000, {variable(0, kU8, 1, true)}),
  };
  EXPECT_EQ(text(configuration_writes(device)),
            "2000:0=1 1800:1=80000185 1A00:0=0 1A00:1=60000108 1A00:2=60000208 1A00:0=2 1800:2=1 "
            "1800:1=185 ");
}

TEST(ConfigurationWrites, AStaticMappingIsNotTouched) {
  od::DeviceDescription device;
  device.objects = {
      record(0x1800, {variable(1, kU32, 0x185, false), variable(2, kU8, 1, true)}),
      record(0x1A00, {variable(0, kU8, 1, false, od::Access::constant),
                      variable(1, kU32, 0x60000108, false, od::Access::ro)}),
  };
  EXPECT_EQ(text(configuration_writes(device)), "1800:1=80000185 1800:2=1 1800:1=185 ");
}

TEST(ConfigurationWrites, AnUnconfiguredPdoCostsNoDownload) {
  od::DeviceDescription device;
  device.objects = {
      record(0x1400, {variable(1, kU32, 0x205, false), variable(2, kU8, 255, false)}),
      record(0x1600, {variable(0, kU8, 1, false), variable(1, kU32, 0x62000108, false)}),
  };
  EXPECT_TRUE(configuration_writes(device).empty());
}

TEST(ConfigurationWrites, ADisabledPdoStaysDisabled) {
  od::DeviceDescription device;
  device.objects = {record(0x1801, {variable(1, kU32, 0x80000285, true)})};
  EXPECT_EQ(text(configuration_writes(device)), "1801:1=80000285 1801:1=80000285 ");
}

// A device file without DefaultValue in the COB-ID: 000h would be NMT (CiA 301 7.3.5).
TEST(ConfigurationWrites, NoPdoBecomesValidWithACanIdThatItMustNotHave) {
  for (const std::uint32_t said : {0x0U, 0x7FU, 0x101U, 0x180U, 0x601U, 0x701U}) {
    od::DeviceDescription device;
    device.objects = {record(0x1804, {variable(1, kU32, said, false), variable(2, kU8, 1, true)})};
    for (const ObjectWrite& write : configuration_writes(device)) {
      if (write.address == od::Address{0x1804, 1}) {
        EXPECT_NE(load_le(std::span<const std::byte>(write.data)) & 0x8000'0000U, 0U) << said;
      }
    }
  }
  od::DeviceDescription device;
  device.node_id = 5;
  device.objects = {record(0x1400, {variable(1, kU32, 0, false), variable(2, kU8, 1, true)}),
                    record(0x1801, {variable(1, kU32, 0, false), variable(2, kU8, 1, true)})};
  device.objects[0].variables[0].value.clear();
  device.objects[1].variables[0].value.clear();
  EXPECT_EQ(text(configuration_writes(device)),
            "1400:1=80000205 1400:2=1 1400:1=205 1801:1=80000285 1801:2=1 1801:1=285 ");
}

std::string text(const std::vector<AssumedPdo>& pdos) {
  std::string out;
  for (const AssumedPdo& pdo : pdos) {
    out += text(pdo.parameters) + "/ " + text(pdo.remedy) + "; ";
  }
  return out;
}

TEST(AssumedPdos, AreThoseOfTheImageWithWhatTheDeviceFilePermits) {
  od::DeviceDescription device;
  device.node_id = 5;
  device.objects = {
      record(0x1400, {variable(1, kU32, 0x205, false), variable(2, kU8, 1, false)}),
      record(0x1600, {variable(0, kU8, 1, false), variable(1, kU32, 0x62000108, false)}),
      record(0x1800, {variable(1, kU32, 0x185, false)}),
      record(0x1801, {variable(1, kU32, 0x80000285, false)}),
      record(0x1802, {variable(1, kU32, 0x385, false, od::Access::constant)}),
      record(0x1A00, {variable(0, kU8, 1, false, od::Access::constant),
                      variable(1, kU32, 0x60000108, false, od::Access::constant)}),
      record(0x1A01, {variable(0, kU8, 1, false), variable(1, kU32, 0x60000108, false)}),
      record(0x1A02, {variable(0, kU8, 1, false, od::Access::ro),
                      variable(1, kU32, 0x60000108, false, od::Access::ro)}),
      record(0x6000, {variable(0, kU8, 1, false), variable(1, kU8, 0, false)}),
      record(0x6200, {variable(0, kU8, 1, false), variable(1, kU8, 0, false)}),
  };
  for (const std::size_t mappable : {std::size_t{8}, std::size_t{9}}) {
    device.objects[mappable].variables[1].mappable = true;
  }
  EXPECT_EQ(text(assumed_pdos(device, true)),
            "1800:1=185 / 1800:1=80000185 1800:1=185 ; "
            "1400:1=205 1400:2=1 1600:0=1 1600:1=62000108 / 1400:1=80000205 1600:0=0 "
            "1600:1=62000108 1600:0=1 1400:2=1 1400:1=205 ; ");
  EXPECT_EQ(text(assumed_pdos(device, false)),
            "1800:1=185 / ; 1400:1=205 1400:2=1 1600:0=1 1600:1=62000108 / ; ");
}

// The device may have constant COB-IDs and mappings, and a type that can be written.
TEST(AssumedPdos, HaveTheTypesOfTpdos) {
  od::DeviceDescription device;
  device.node_id = 5;
  device.objects = {
      record(0x1800, {variable(1, kU32, 0x185, false), variable(2, kU8, 253, false)}),
      record(0x1801,
             {variable(1, kU32, 0x285, false, od::Access::constant), variable(2, kU8, 1, false)}),
      record(0x1802, {variable(1, kU32, 0x385, false, od::Access::constant),
                      variable(2, kU8, 1, false, od::Access::constant)}),
  };
  for (std::uint16_t i = 0; i < 3; ++i) {
    device.objects.push_back(record(static_cast<std::uint16_t>(0x1A00 + i),
                                    {variable(0, kU8, 1, false, od::Access::constant),
                                     variable(1, kU32, 0x60000108, false, od::Access::constant)}));
  }
  device.objects.push_back(record(0x6000, {variable(1, kU8, 0, false)}));
  device.objects.back().variables[0].mappable = true;
  const std::vector<AssumedPdo> pdos = assumed_pdos(device, true);
  ASSERT_EQ(pdos.size(), 2U);
  ASSERT_TRUE(pdos[0].sent && pdos[1].sent);
  EXPECT_EQ(pdos[0].sent->record, 0x1800);
  EXPECT_EQ(pdos[0].sent->type, 253);
  EXPECT_EQ(pdos[1].sent->record, 0x1801);
  EXPECT_EQ(pdos[1].sent->type, 1);
  EXPECT_TRUE(pdos[1].parameters.empty());
}

TEST(AssumedPdos, OthersMustNotHaveTheirCobIds) {
  od::DeviceDescription device;
  device.node_id = 5;
  device.objects = {
      record(0x1800, {variable(1, kU32, 0x185, false, od::Access::constant)}),
      record(0x1801, {variable(1, kU32, 0x80000285, false)}),
      record(0x1802, {variable(1, kU32, 0x80000385, false, od::Access::constant)}),
      record(0x1A00, {variable(0, kU8, 1, false, od::Access::constant),
                      variable(1, kU32, 0x60000108, false, od::Access::constant)}),
      record(0x6000, {variable(0, kU8, 1, false), variable(1, kU8, 0, false)}),
  };
  device.objects.back().variables[1].mappable = true;
  for (const bool correct : {true, false}) {
    std::vector<NodePlan> plans(2);
    add_other_pdos(std::vector<const od::DeviceDescription*>{&device, &device}, {correct, correct},
                   plans);
    EXPECT_EQ(text(plans[1].pdos),
              correct ? "1801:1=80000000 / 1801:1=80000000 ; " : "1801:1=80000000 / ; ");
    EXPECT_EQ(*plans[1].pdos.at(0).taken, (CobIds{0x185, 0x185})) << "of TPDOs";
  }
}

TEST(AssumedPdos, ChangeTheDateOfAConfiguration) {
  const std::vector<ObjectWrite> writes{{{0x2000, 1}, {std::byte{1}}}};
  const AssumedPdo one{.parameters = {{{0x1A00, 0}, {std::byte{1}}}}, .remedy = {}};
  const AssumedPdo two{.parameters = {{{0x1A00, 0}, {std::byte{2}}}}, .remedy = {}};
  EXPECT_NE(fingerprint_of(writes, std::vector{one}), fingerprint_of(writes, std::vector{two}));
  EXPECT_EQ(fingerprint_of(writes, std::vector{one}), fingerprint_of(writes, std::vector{one}));
}

TEST(BootStatus, EveryLetterOfCia302HasWords) {
  for (char letter = 'A'; letter <= 'O'; ++letter) {
    EXPECT_NE(describe_boot(letter), "unknown boot status") << letter;
  }
  EXPECT_EQ(describe_boot('P'), "unknown boot status");
  EXPECT_EQ(describe_boot(kBooted), "booted");
}

}  // namespace
}  // namespace linegate::manager
