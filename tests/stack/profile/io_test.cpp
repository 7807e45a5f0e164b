// SPDX-License-Identifier: Apache-2.0
// Generic I/O modules, CiA 401.
#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/eds/reader.h"
#include "stack/eds/writer.h"
#include "stack/od/dictionary.h"
#include "stack/pdo/parameters.h"
#include "stack/profile/io_behaviour.h"
#include "stack/profile/io_device.h"

namespace linegate::profile {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

std::vector<std::uint32_t> mapped(const pdo::Parameters& pdo) {
  std::vector<std::uint32_t> out;
  for (const pdo::Mapping& mapping : pdo.mapping) {
    out.push_back(mapping.raw());
  }
  return out;
}

TEST(IoDevice, HasTheDefaultMappingOfTheProfile) {  // CiA 401
  const auto device = make_io_device(
      {.digital_inputs = 9, .digital_outputs = 2, .analogue_inputs = 6, .analogue_outputs = 13},
      "io", 5);
  const auto pdos = pdo::describe_pdos(device);
  ASSERT_TRUE(pdos.ok());
  EXPECT_THAT(pdos.diagnostics, IsEmpty());
  ASSERT_THAT(pdos.value->tpdos, SizeIs(3));
  EXPECT_EQ(pdos.value->tpdos[0].cob_id.id(), 0x185U);
  EXPECT_THAT(mapped(pdos.value->tpdos[0]),
              ElementsAre(0x60000108, 0x60000208, 0x60000308, 0x60000408, 0x60000508, 0x60000608,
                          0x60000708, 0x60000808));
  EXPECT_EQ(pdos.value->tpdos[1].cob_id.id(), 0x285U);
  EXPECT_THAT(mapped(pdos.value->tpdos[1]),
              ElementsAre(0x64010110, 0x64010210, 0x64010310, 0x64010410));
  EXPECT_THAT(mapped(pdos.value->tpdos[2]), ElementsAre(0x64010510, 0x64010610));
  EXPECT_EQ(pdos.value->tpdos[2].type, 255);
  ASSERT_THAT(pdos.value->rpdos, SizeIs(4));
  EXPECT_THAT(mapped(pdos.value->rpdos[0]), ElementsAre(0x62000108, 0x62000208));
  EXPECT_EQ(pdos.value->rpdos[3].cob_id.id(), 0x505U);
  EXPECT_THAT(mapped(pdos.value->rpdos[3]),
              ElementsAre(0x64110910, 0x64110A10, 0x64110B10, 0x64110C10));
}

TEST(IoDevice, SaysIn1000hWhatItHas) {
  const auto type = [](const IoBlocks& blocks) {
    return *od::Dictionary(make_io_device(blocks, "io", 1)).number({0x1000, 0});
  };
  EXPECT_EQ(type({.digital_inputs = 1}), 0x0001'0191U);
  EXPECT_EQ(type({.digital_outputs = 1}), 0x0002'0191U);
  EXPECT_EQ(type({.analogue_inputs = 1}), 0x0004'0191U);
  EXPECT_EQ(type({.analogue_outputs = 1}), 0x0008'0191U);
  EXPECT_EQ(make_io_device({.digital_inputs = 1}, "io", 1).find(0x6200), nullptr);
  EXPECT_EQ(make_io_device({.analogue_outputs = 1}, "io", 1).find(0x6401), nullptr);
}

TEST(IoDevice, ItsEdsIsUnderstoodForAnyNodeId) {
  const IoBlocks most{254, 254, 254, 254};
  eds::DataSheet sheet = eds::sheet_of(make_io_device(most, "io", 5));
  const auto read = eds::load(eds::write_eds(sheet), "io.eds", 9);
  ASSERT_TRUE(read.ok()) << to_string(read.diagnostics.at(0));
  EXPECT_THAT(read.diagnostics, IsEmpty());
  const od::Dictionary nine(*read.value);
  const od::Dictionary wanted(make_io_device(most, "io", 9));
  EXPECT_EQ(nine.indices(), wanted.indices());
  constexpr std::uint16_t kIndices[] = {0x1014, 0x1400, 0x1403, 0x1800, 0x1803, 0x6005, 0x6206};
  for (const std::uint16_t index : kIndices) {
    for (std::uint8_t sub = 0; sub <= 2; ++sub) {
      EXPECT_EQ(nine.number({index, sub}), wanted.number({index, sub})) << std::hex << index;
    }
  }
}

class IoBehaviourTest : public testing::Test {
 protected:
  IoBehaviourTest()
      : dictionary_(make_io_device({.digital_inputs = 2,
                                    .digital_outputs = 2,
                                    .analogue_inputs = 2,
                                    .analogue_outputs = 2},
                                   "io", 5)),
        io_(dictionary_) {}

  bool digital(std::uint64_t before, std::uint64_t now) {
    return io_.is_reported({0x6000, 1}, before, now);
  }
  bool analogue(int now) {
    return io_.is_reported({0x6401, 1}, 0, static_cast<std::uint16_t>(now));
  }
  void set(std::uint16_t index, std::uint8_t sub, std::uint32_t value) {
    ASSERT_TRUE(dictionary_.set({index, sub}, value));
  }

  od::Dictionary dictionary_;
  IoBehaviour io_;
};

TEST_F(IoBehaviourTest, DigitalInputsAreToldAsTheMasksSay) {
  EXPECT_TRUE(digital(0, 1));
  EXPECT_TRUE(digital(1, 0));
  set(0x6006, 1, 0x02);
  EXPECT_FALSE(digital(0, 1));
  EXPECT_TRUE(digital(1, 3));
  set(0x6006, 1, 0);
  set(0x6007, 1, 0x01);
  EXPECT_TRUE(digital(0, 1));
  EXPECT_FALSE(digital(1, 0));
  set(0x6007, 1, 0);
  set(0x6008, 1, 0x01);
  EXPECT_FALSE(digital(0, 1));
  EXPECT_TRUE(digital(1, 0));
  set(0x6005, 0, 0);
  EXPECT_FALSE(digital(1, 0));
  EXPECT_TRUE(io_.is_reported({0x2000, 0}, 0, 1));
}

TEST_F(IoBehaviourTest, AnalogueInputsAreToldOnceTheMasterWantsThem) {
  EXPECT_FALSE(analogue(100));
  set(0x6423, 0, 1);
  EXPECT_TRUE(analogue(100));
  EXPECT_TRUE(analogue(101));
  set(0x6426, 1, 10);
  EXPECT_FALSE(analogue(111));
  EXPECT_TRUE(analogue(112));
  EXPECT_FALSE(analogue(102));
  EXPECT_TRUE(analogue(-32768));
  EXPECT_TRUE(analogue(32767));
}

TEST_F(IoBehaviourTest, AnalogueInputsAreToldBeyondLimitsAndByDirection) {
  set(0x6423, 0, 1);
  set(0x6424, 1, 1000);
  set(0x6425, 1, static_cast<std::uint32_t>(-1000));
  EXPECT_TRUE(analogue(1)) << "limits do not count unless they are selected";
  set(0x6421, 1, 0x03);
  EXPECT_FALSE(analogue(1000));
  EXPECT_TRUE(analogue(1001));
  EXPECT_TRUE(analogue(1001)) << "no difference is selected";
  EXPECT_FALSE(analogue(0));
  EXPECT_FALSE(analogue(-1000));
  EXPECT_TRUE(analogue(-1001));
  set(0x6421, 1, 0x01);
  EXPECT_FALSE(analogue(-1002));
  set(0x6421, 1, 0x18);
  set(0x6427, 1, 10);
  set(0x6428, 1, 20);
  EXPECT_FALSE(analogue(-1011));
  EXPECT_TRUE(analogue(-1012)) << "less by 11 than -1001";
  EXPECT_FALSE(analogue(-992));
  EXPECT_TRUE(analogue(-991));
  set(0x6421, 1, 0x05);
  EXPECT_FALSE(analogue(500)) << "both conditions are necessary";
  EXPECT_TRUE(analogue(1500));
  EXPECT_FALSE(analogue(1500));
}

TEST_F(IoBehaviourTest, PolarityAndScalingStandBetweenValuesAndTerminals) {
  const auto u16 = [](int value) { return static_cast<std::uint16_t>(value); };
  EXPECT_EQ(io_.input_value({0x6000, 1}, 0x0F), 0x0FU);
  set(0x6002, 1, 0x81);
  EXPECT_EQ(io_.input_value({0x6000, 1}, 0x0F), 0x8EU);
  EXPECT_EQ(io_.input_value({0x6000, 2}, 0x0F), 0x0FU);
  set(0x6202, 2, 0xF0);
  EXPECT_EQ(io_.terminal_value({0x6200, 2}, 0x3C, 0), 0xCCU);
  set(0x6208, 2, 0x0F);
  EXPECT_EQ(io_.terminal_value({0x6200, 2}, 0x3C, 0x55), 0x5CU) << "other bits are unchanged";
  set(0x6432, 1, 10);
  set(0x6431, 1, static_cast<std::uint32_t>(-5));
  EXPECT_EQ(io_.input_value({0x6401, 1}, 7), 65U);
  EXPECT_EQ(io_.input_value({0x6401, 1}, u16(-7)), u16(-75));
  EXPECT_EQ(io_.input_value({0x6401, 1}, 10'000), 32'767U) << "limited to 16 bits";
  set(0x6447, 1, 0xFFFF'FFFF);
  set(0x6446, 1, 3);
  EXPECT_EQ(io_.terminal_value({0x6411, 1}, 7, 0), u16(-4));
  EXPECT_EQ(io_.terminal_value({0x6411, 1}, u16(-32'768), 0), 32'767U);
  EXPECT_EQ(io_.input_value({0x2000, 1}, 7), 7U);
  EXPECT_EQ(IoBehaviour::converted_by(0x6002), 0x6000);
  EXPECT_EQ(IoBehaviour::converted_by(0x6208), 0x6200);
  EXPECT_EQ(IoBehaviour::converted_by(0x6431), 0x6401);
  EXPECT_EQ(IoBehaviour::converted_by(0x6447), 0x6411);
  EXPECT_EQ(IoBehaviour::converted_by(0x6000), 0);
}

TEST(IoDevice, StoresParametersOnRequest) {
  EXPECT_EQ(make_io_device({.digital_inputs = 1}, "io", 5).find(0x1010), nullptr);
  const auto device = make_io_device({.digital_inputs = 1}, "io", 5, true);
  EXPECT_NE(device.find(0x1010), nullptr);
  EXPECT_NE(device.find(0x1011), nullptr);
  EXPECT_NE(device.find(0x1020), nullptr);
}

TEST_F(IoBehaviourTest, OutputsTakeTheirErrorValues) {
  set(0x6200, 1, 0xFF);
  set(0x6200, 2, 0xFF);
  set(0x6206, 1, 0x0F);
  set(0x6207, 1, 0x03);
  set(0x6411, 1, 77);
  set(0x6411, 2, 77);
  set(0x6443, 2, 0);
  set(0x6444, 1, 0xFFFF'FFFE);
  io_.apply_error_values();
  EXPECT_EQ(dictionary_.number({0x6200, 1}), 0xF3U);
  EXPECT_EQ(dictionary_.number({0x6200, 2}), 0U);
  EXPECT_EQ(dictionary_.number({0x6411, 1}), 0xFFFEU);
  EXPECT_EQ(dictionary_.number({0x6411, 2}), 77U);
}

}  // namespace
}  // namespace linegate::profile
