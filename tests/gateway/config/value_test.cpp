// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/value.h"

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::config {
namespace {

using namespace std::chrono_literals;

std::optional<std::vector<int>> bytes(std::string_view text, od::DataType type) {
  const auto value = parse_value(text, type);
  if (!value) {
    return std::nullopt;
  }
  std::vector<int> out;
  for (const std::byte b : *value) {
    out.push_back(std::to_integer<int>(b));
  }
  return out;
}

TEST(Duration, HasAUnit) {
  EXPECT_EQ(parse_duration("10us"), 10us);
  EXPECT_EQ(parse_duration("100ms"), 100ms);
  EXPECT_EQ(parse_duration("100 ms"), 100ms);
  EXPECT_EQ(parse_duration("1.5s"), 1500ms);
  EXPECT_EQ(parse_duration("2min"), 2min);
  EXPECT_EQ(parse_duration("1h"), 1h);
  EXPECT_EQ(parse_duration("0"), 0ns);
  EXPECT_EQ(parse_duration("24h"), 24h);
  for (const char* bad : {"", "100", "ms", "-1ms", "1sec", "1.2.3s", "1e3s", "25h", "1ms2", "."}) {
    EXPECT_EQ(parse_duration(bad), std::nullopt) << bad;
  }
}

TEST(Duration, IsWrittenShort) {
  EXPECT_EQ(format_duration(0ns), "0");
  EXPECT_EQ(format_duration(1500ms), "1500ms");
  EXPECT_EQ(format_duration(60s), "60s");
  EXPECT_EQ(format_duration(10us), "10us");
  EXPECT_EQ(format_duration(5ns), "5ns");
}

TEST(BitRate, HasAUnit) {
  EXPECT_EQ(parse_bit_rate("500kbit"), 500'000U);
  EXPECT_EQ(parse_bit_rate("1Mbit"), 1'000'000U);
  EXPECT_EQ(parse_bit_rate("1Mbit/s"), 1'000'000U);
  EXPECT_EQ(parse_bit_rate("83.333kbit"), 83'333U);
  for (const char* bad : {"", "500", "500k", "0kbit", "9Mbit", "-1kbit"}) {
    EXPECT_EQ(parse_bit_rate(bad), std::nullopt) << bad;
  }
}

TEST(Address, IsHexadecimal) {
  EXPECT_EQ(parse_address("6083:1"), (od::Address{0x6083, 1}));
  EXPECT_EQ(parse_address("6083"), (od::Address{0x6083, 0}));
  EXPECT_EQ(parse_address("0x1800:0x0A"), (od::Address{0x1800, 10}));
  for (const char* bad : {"", ":", "6083:", ":1", "6083:100", "10000:1", "xyz", "6083:1:2"}) {
    EXPECT_EQ(parse_address(bad), std::nullopt) << bad;
  }
  EXPECT_EQ(format_address({0x1A00, 0x0B}), "1A00:0B");
}

TEST(Value, FollowsTheType) {
  using T = od::DataType;
  EXPECT_EQ(bytes("500", T::unsigned16), (std::vector<int>{0xF4, 0x01}));
  EXPECT_EQ(bytes("0x01F4", T::unsigned16), (std::vector<int>{0xF4, 0x01}));
  EXPECT_EQ(bytes("-1", T::integer24), (std::vector<int>{0xFF, 0xFF, 0xFF}));
  EXPECT_EQ(bytes("0xFF", T::integer8), (std::vector<int>{0xFF})) << "a bit pattern";
  EXPECT_EQ(bytes("true", T::boolean), (std::vector<int>{1}));
  EXPECT_EQ(bytes("1.5", T::real32), (std::vector<int>{0, 0, 0xC0, 0x3F}));
  EXPECT_EQ(bytes("ab", T::visible_string), (std::vector<int>{'a', 'b'}));
  EXPECT_EQ(bytes("01 02 fF", T::octet_string), (std::vector<int>{1, 2, 255}));
  EXPECT_EQ(bytes("18446744073709551615", T::unsigned64)->size(), 8U);
  EXPECT_EQ(bytes("-128", T::integer8), (std::vector<int>{0x80}));

  EXPECT_EQ(bytes("256", T::unsigned8), std::nullopt);
  EXPECT_EQ(bytes("-1", T::unsigned8), std::nullopt);
  EXPECT_EQ(bytes("128", T::integer8), std::nullopt);
  EXPECT_EQ(bytes("-129", T::integer8), std::nullopt);
  EXPECT_EQ(bytes("2", T::boolean), std::nullopt);
  EXPECT_EQ(bytes("1x", T::unsigned32), std::nullopt);
  EXPECT_EQ(bytes("fast", T::real32), std::nullopt);
  EXPECT_EQ(bytes("1e39", T::real32), std::nullopt);
  EXPECT_EQ(bytes("01 02", T::time_of_day), std::nullopt);
  EXPECT_EQ(bytes("012", T::domain), std::nullopt);
}

TEST(Nearest, FindsTheTypingError) {
  const std::vector<std::string> names{"interface", "heartbeat", "name"};
  EXPECT_EQ(nearest("intreface", names), "interface");
  EXPECT_EQ(nearest("Name", names), "name");
  EXPECT_EQ(nearest("voltage", names), "");
}

TEST(Size, HasAUnit) {
  EXPECT_EQ(parse_size("5000B"), 5000U);
  EXPECT_EQ(parse_size("1.5kB"), 1500U);
  EXPECT_EQ(parse_size("100 MB"), 100'000'000U);
  EXPECT_EQ(parse_size("1TB"), 1'000'000'000'000U);
  for (const char* text : {"", "5", "MB", "2TB", "-1kB", "1KB", "1kbit"}) {
    EXPECT_FALSE(parse_size(text)) << text;
  }
}

TEST(Size, IsWrittenShort) {
  EXPECT_EQ(format_size(0), "0B");
  EXPECT_EQ(format_size(1500), "1500B");
  EXPECT_EQ(format_size(64'000), "64kB");
  EXPECT_EQ(format_size(250'000'000), "250MB");
  EXPECT_EQ(format_size(1'000'000'000'000'000), "1000TB");
}

TEST(Age, HasAUnit) {
  EXPECT_EQ(parse_age("90d"), std::chrono::hours(90 * 24));
  EXPECT_EQ(parse_age("36h"), std::chrono::hours(36));
  EXPECT_EQ(parse_age("5min"), std::chrono::minutes(5));
  EXPECT_EQ(format_age(std::chrono::hours(48)), "2d");
  EXPECT_EQ(format_age(std::chrono::hours(36)), "36h");
  EXPECT_EQ(format_age(std::chrono::seconds(90)), "90s");
  EXPECT_EQ(parse_age("36600d"), std::chrono::hours(36'600 * 24));
  for (const char* text :
       {"", "d", "5", "0d", "-1d", "1.5d", "36601d", "59s", "90 days", "18446744073709551615d"}) {
    EXPECT_FALSE(parse_age(text)) << text;
  }
}

}  // namespace
}  // namespace linegate::config
