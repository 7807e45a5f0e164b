// SPDX-License-Identifier: Apache-2.0
// The order of the writes to 1300h to 13FFh.
#include "stack/srdo/configuration.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "stack/srdo/parameters.h"

#include "tests/stack/srdo/srdo_device.h"

namespace linegate::srdo {
namespace {

using Writes = std::vector<manager::ObjectWrite>;

manager::ObjectWrite write(std::uint16_t index, std::uint8_t sub, std::uint64_t value,
                           std::size_t bytes) {
  manager::ObjectWrite out{{index, sub}, std::vector<std::byte>(bytes)};
  store_le(std::span(out.data), value);
  return out;
}

// "index:sub=value" of each write, hexadecimal.
std::string text(const Writes& writes) {
  std::string out;
  for (const manager::ObjectWrite& each : writes) {
    std::array<char, 40> one{};
    (void)std::snprintf(
        one.data(), one.size(), "%04X:%u=%llX ", each.address.index, each.address.sub,
        static_cast<unsigned long long>(load_le(std::span<const std::byte>(each.data))));
    out += one.data();
  }
  return out;
}

std::string ordered(Writes writes, const od::DeviceDescription& device = srdo_device()) {
  order_writes(device, writes);
  return text(writes);
}

TEST(OrderWrites, OthersAreUntouched) {
  EXPECT_EQ(ordered({write(0x2000, 1, 5, 1), write(0x1017, 0, 500, 2)}), "2000:1=5 1017:0=1F4 ");
  EXPECT_EQ(ordered({write(0x13FE, 0, 0xA5, 1), write(0x2000, 1, 5, 1)}), "13FE:0=A5 2000:1=5 ")
      << "no parameter is written";
}

TEST(OrderWrites, InvalidFirstValidLast) {
  EXPECT_EQ(ordered({write(0x13FE, 0, 0xA5, 1), write(0x1301, 3, 30, 1), write(0x2000, 1, 5, 1),
                     write(0x13FF, 1, 0x1234, 2)}),
            "2000:1=5 13FE:0=0 1301:1=0 1301:3=1E 1301:1=1 13FF:1=1234 13FE:0=A5 ");
}

TEST(OrderWrites, AMappingIsWrittenWhileTheSrdoIsOff) {
  EXPECT_EQ(ordered({write(0x1381, 0, 2, 1), write(0x1301, 1, 1, 1),
                     write(0x1381, 2, 0x20000208, 4), write(0x1381, 1, 0x20000108, 4),
                     write(0x1300, 0, 1, 1), write(0x13FF, 1, 0x1234, 2)}),
            "13FE:0=0 1300:0=1 1301:1=0 1381:0=0 1381:1=20000108 1381:2=20000208 1381:0=2 1301:1=1 "
            "13FF:1=1234 13FE:0=A5 ");
}

TEST(OrderWrites, TheSignatureIsThatOfTheParametersThatAreWritten) {
  od::DeviceDescription device = srdo_device();
  device.node_id = 9;
  EXPECT_NE(ordered({write(0x1301, 2, 25, 2)}, device).find("13FF:1=51AF "), std::string::npos);
  EXPECT_EQ(ordered({write(0x1301, 2, 26, 2)}, device).find("13FF:1=51AF "), std::string::npos);
}

// Node 9 without values of 1301h:5 and :6 has its SRDO 1 on 111h and 112h.
TEST(OrderWrites, TheSignatureHasTheDefaultIdentifiersWithTheNodeId) {
  od::DeviceDescription device = srdo_device();
  device.node_id = 9;
  for (const std::uint8_t sub : {kCobId, kInvertedCobId}) {
    device.find(od::Address{0x1301, sub})->value.clear();
  }
  EXPECT_NE(ordered({write(0x1301, 2, 25, 2)}, device).find("13FF:1=2F78 "), std::string::npos);
}

TEST(OrderWrites, OfSeveralWritesToAnObjectTheLastCounts) {
  EXPECT_EQ(ordered({write(0x1301, 1, 2, 1), write(0x1301, 1, 0, 1)}),
            "13FE:0=0 1301:1=0 1301:1=0 13FE:0=A5 ");
}

TEST(OrderWrites, EachObjectIsWritten) {
  EXPECT_EQ(ordered({write(0x1301, 3, 30, 1), write(0x13FF, 2, 0x1234, 2), write(0x1381, 3, 0, 4),
                     write(0x1341, 0, 7, 1), write(0x1301, 7, 8, 1)}),
            "13FE:0=0 1341:0=7 1301:1=0 1381:0=0 1381:3=0 1381:0=2 1301:3=1E 1301:7=8 1301:1=1 "
            "13FF:1=8770 13FF:2=1234 13FE:0=A5 ");
}

TEST(OrderWrites, AnObjectThatTheFileHasAsReadOnlyIsWrittenIfItIsConfigured) {
  od::DeviceDescription device = srdo_device();
  device.find(od::Address{0x1301, 1})->access = od::Access::ro;
  device.find(od::Address{0x1381, 0})->access = od::Access::ro;
  device.find(od::Address{0x13FE, 0})->access = od::Access::ro;
  EXPECT_EQ(ordered({write(0x1301, 1, 1, 1), write(0x1381, 0, 2, 1), write(0x13FE, 0, 0xA5, 1),
                     write(0x13FF, 1, 0x1234, 2)},
                    device),
            "1381:0=2 1301:1=1 13FF:1=1234 13FE:0=A5 ");
}

// It could not be restored.
TEST(OrderWrites, ADirectionThatIsNotKnownIsNotSwitchedOff) {
  od::DeviceDescription device = srdo_device();
  device.find(od::Address{0x1301, 1})->value.clear();
  EXPECT_EQ(ordered({write(0x1301, 3, 30, 1)}, device), "13FE:0=0 1301:3=1E 13FE:0=A5 ");
}

TEST(OrderWrites, WhatTheDeviceDoesNotHaveIsNotAdded) {
  od::DeviceDescription device = srdo_device();
  std::erase_if(device.objects, [](const auto& object) { return object.index >= 0x13FE; });
  device.find(od::Address{0x1301, 1})->access = od::Access::ro;
  EXPECT_EQ(ordered({write(0x1301, 3, 30, 1)}, device), "1301:3=1E ");
}

}  // namespace
}  // namespace linegate::srdo
