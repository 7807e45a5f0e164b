// SPDX-License-Identifier: Apache-2.0
#include "stack/base/abort_code.h"

#include <set>
#include <string>

#include <gtest/gtest.h>

namespace linegate {
namespace {

struct Row {
  std::uint32_t code;
  AbortCode name;
  std::string_view word;  // a word of its description
};

// CiA 301, 7.2.4.3.17.
constexpr Row kTable[] = {
    {0x0503'0000, AbortCode::toggle_bit, "toggle"},
    {0x0504'0000, AbortCode::timeout, "timed out"},
    {0x0504'0001, AbortCode::command_specifier, "command specifier"},
    {0x0504'0002, AbortCode::block_size, "block size"},
    {0x0504'0003, AbortCode::sequence_number, "sequence number"},
    {0x0504'0004, AbortCode::crc, "CRC"},
    {0x0504'0005, AbortCode::out_of_memory, "memory"},
    {0x0601'0000, AbortCode::unsupported_access, "unsupported access"},
    {0x0601'0001, AbortCode::write_only, "write-only"},
    {0x0601'0002, AbortCode::read_only, "read-only"},
    {0x0602'0000, AbortCode::no_object, "object does not exist"},
    {0x0604'0041, AbortCode::not_mappable, "mapped"},
    {0x0604'0042, AbortCode::pdo_length_exceeded, "PDO length"},
    {0x0604'0043, AbortCode::parameter_incompatible, "parameter incompatibility"},
    {0x0604'0047, AbortCode::device_incompatible, "internal incompatibility"},
    {0x0606'0000, AbortCode::hardware, "hardware"},
    {0x0607'0010, AbortCode::length_mismatch, "length does not match"},
    {0x0607'0012, AbortCode::length_too_high, "length too high"},
    {0x0607'0013, AbortCode::length_too_low, "length too low"},
    {0x0609'0011, AbortCode::no_sub_index, "sub-index"},
    {0x0609'0030, AbortCode::invalid_value, "invalid value"},
    {0x0609'0031, AbortCode::value_too_high, "too high"},
    {0x0609'0032, AbortCode::value_too_low, "too low"},
    {0x0609'0036, AbortCode::max_less_than_min, "less than minimum"},
    {0x060A'0023, AbortCode::sdo_connection, "SDO connection"},
    {0x0800'0000, AbortCode::general, "general error"},
    {0x0800'0020, AbortCode::cannot_transfer, "transferred or stored"},
    {0x0800'0021, AbortCode::local_control, "local control"},
    {0x0800'0022, AbortCode::device_state, "device state"},
    {0x0800'0023, AbortCode::no_dictionary, "object dictionary not present"},
    {0x0800'0024, AbortCode::no_data, "no data"},
};

TEST(AbortCodes, NumbersAndWordsOfCia301) {
  std::set<std::string_view> descriptions;
  for (const Row& row : kTable) {
    EXPECT_EQ(static_cast<std::uint32_t>(row.name), row.code) << row.word;
    const std::string_view text = describe(static_cast<AbortCode>(row.code));
    EXPECT_NE(text.find(row.word), std::string_view::npos) << text;
    EXPECT_TRUE(descriptions.insert(text).second) << text;
  }
  EXPECT_EQ(describe(AbortCode{0x0503'0001}), "unknown abort code");
}

}  // namespace
}  // namespace linegate
