// SPDX-License-Identifier: Apache-2.0
// SRDOs by device files, and every fault in them.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "stack/srdo/parameters.h"

#include "tests/stack/srdo/srdo_device.h"

namespace linegate::srdo {
namespace {

void set(od::DeviceDescription& device, od::Address address, std::uint64_t value,
         bool configured = false) {
  od::VariableDescription* const variable = device.find(address);
  ASSERT_NE(variable, nullptr);
  store_le(std::span(variable->value), value);
  variable->overridden = configured;
}

// The texts of the diagnostics for a device with this value.
std::string findings(od::Address address, std::uint64_t value, bool configured = true) {
  od::DeviceDescription device = srdo_device();
  set(device, address, value, configured);
  std::string out;
  for (const Diagnostic& found : describe_srdos(device).diagnostics) {
    out += (found.severity == Severity::error ? "error: " : "warning: ") + found.text + "\n";
  }
  return out;
}

TEST(DescribeSrdo, HasTheParametersOfTheRecords) {
  const auto loaded = describe_srdos(srdo_device());
  ASSERT_TRUE(loaded.ok());
  EXPECT_TRUE(loaded.diagnostics.empty());
  ASSERT_EQ(loaded.value->size(), 1U);
  const Parameters& srdo = loaded.value->front();
  EXPECT_EQ(srdo.number, 1);
  EXPECT_EQ(srdo.direction, Direction::transmit);
  EXPECT_EQ(srdo.cycle_ms, 25);
  EXPECT_EQ(srdo.validation_ms, 20);
  EXPECT_EQ(srdo.cob_id, 0x101U);
  EXPECT_EQ(srdo.inverted_cob_id, 0x102U);
  ASSERT_EQ(srdo.mapping.size(), 2U);
  EXPECT_EQ(srdo.mapping[1].raw(), 0x2000'0208U);
}

TEST(DescribeSrdo, OneWithoutADirectionIsNone) {
  od::DeviceDescription device = srdo_device();
  set(device, {0x1301, 1}, 0);
  set(device, {0x1301, 5}, 0);
  const auto loaded = describe_srdos(device);
  ASSERT_TRUE(loaded.ok());
  EXPECT_TRUE(loaded.value->empty());
  EXPECT_TRUE(loaded.diagnostics.empty());
}

TEST(DescribeSrdo, EachFaultIsAnError) {
  EXPECT_EQ(findings({0x1301, 1}, 3), "error: SRDO 1 (1301:01) direction 3 is none\n");
  EXPECT_EQ(findings({0x1301, 2}, 0),
            "error: SRDO 1 (1301:02) refresh time or SCT is 0: give 1 to 65535 ms\n");
  EXPECT_EQ(findings({0x1301, 3}, 0), "error: SRDO 1 (1301:03) SRVT is 0: give 1 to 255 ms\n");
  EXPECT_EQ(findings({0x1301, 5}, 0x102),
            "error: SRDO 1 (1301:05) COB-ID 1 102h is not an odd one of 101h to 17Fh\n");
  EXPECT_EQ(findings({0x1301, 5}, 0x181),
            "error: SRDO 1 (1301:05) COB-ID 1 181h is not an odd one of 101h to 17Fh\n");
  EXPECT_EQ(findings({0x1301, 6}, 0x104),
            "error: SRDO 1 (1301:06) COB-ID 2 104h is not that after COB-ID 1\n");
  EXPECT_EQ(findings({0x1381, 0}, 1),
            "error: SRDO 1 (1381:00) maps 1 objects, not 2 to 16 in pairs\n");
  EXPECT_EQ(findings({0x1381, 0}, 18),
            "error: SRDO 1 (1381:00) maps 18 objects, not 2 to 16 in pairs\n");
  EXPECT_EQ(findings({0x1381, 1}, 0x2001'0108),
            "error: SRDO 1 (1381:01) maps 2001:01, which does not exist\n");
  EXPECT_EQ(findings({0x1381, 2}, 0x2000'0210),
            "error: SRDO 1 (1381:02) maps 2000:02 with 16 bits, but it is UNSIGNED8 (and 1 more of "
            "this SRDO)\n");
}

// A device file may have a longer type.
TEST(DescribeSrdo, ATimeIsNotCut) {
  od::DeviceDescription device = srdo_device();
  od::VariableDescription* const srvt = device.find(od::Address{0x1301, 3});
  srvt->type = od::DataType::unsigned16;
  srvt->value = {std::byte{20}, std::byte{1}};
  srvt->overridden = true;
  const auto loaded = describe_srdos(device);
  ASSERT_EQ(loaded.diagnostics.size(), 1U);
  EXPECT_EQ(loaded.diagnostics[0].text, "SRDO 1 (1301:03) SRVT is 276: give 1 to 255 ms");
}

TEST(DescribeSrdo, OneThatTheDeviceReceivesMayHaveDummyEntries) {
  od::DeviceDescription device = srdo_device();
  set(device, {0x1301, 1}, 2);
  for (std::uint8_t sub = 1; sub <= 2; ++sub) {
    set(device, {0x1381, sub}, 0x0005'0008, true);
  }
  EXPECT_TRUE(describe_srdos(device).ok());
  set(device, {0x1301, 1}, 1);
  EXPECT_FALSE(describe_srdos(device).ok()) << "a device transmits objects";
}

TEST(DescribeSrdo, OfAnSrdoThatIsNotConfiguredItIsAWarning) {
  EXPECT_EQ(findings({0x1301, 3}, 0, false),
            "warning: SRDO 1 (1301:03) SRVT is 0: give 1 to 255 ms; the SRDO is left out\n");
}

TEST(DescribeSrdo, ASignatureThatDoesNotMatchIsReported) {
  od::DeviceDescription device = srdo_device();
  const std::uint16_t right = signature(describe_srdos(device).value->front());
  EXPECT_EQ(findings({0x13FF, 1}, right), "");
  EXPECT_NE(findings({0x13FF, 1}, right ^ 1U).find("error: SRDO 1 (13FF:01) signature is "),
            std::string::npos);
  EXPECT_NE(findings({0x13FF, 1}, right ^ 1U, false).find("warning: SRDO 1 (13FF:01) signature"),
            std::string::npos);
  EXPECT_EQ(findings({0x13FF, 1}, 0, false), "") << "a device that is not configured";
  EXPECT_NE(findings({0x13FE, 0}, kConfigurationValid, false).find("signature is 0000h"),
            std::string::npos)
      << "a valid configuration has a signature";
}

}  // namespace
}  // namespace linegate::srdo
