// SPDX-License-Identifier: Apache-2.0
// A sample by which an application writes outputs by name, with a member of every form. Promise:
// whatever it contains, what was read lies within the group and the bounds of the contract, and has
// a key.
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bridges/named/group_types.h"
#include "bridges/named/set_plan.h"
#include "stack/image/layout.h"

#include "tests/fuzz/expect.h"

namespace {

using linegate::image::Entry;
using linegate::image::Layout;
using linegate::named::SetPlan;
using linegate::od::DataType;

constexpr std::size_t kLongestText = 64;

Layout every_form() {
  constexpr std::pair<DataType, std::uint16_t> kEntries[] = {
      {DataType::boolean, 1},          {DataType::integer8, 8},        {DataType::integer24, 24},
      {DataType::integer64, 64},       {DataType::unsigned16, 12},     {DataType::unsigned32, 32},
      {DataType::unsigned56, 56},      {DataType::real32, 32},         {DataType::real64, 64},
      {DataType::visible_string, 64},  {DataType::unicode_string, 64}, {DataType::time_of_day, 48},
      {DataType::time_difference, 48}, {DataType::octet_string, 12},   {DataType::none, 24}};
  Layout layout;
  layout.direction = linegate::image::Direction::outputs;
  layout.id = 1;
  std::uint32_t at = 0;
  for (const auto& [type, bits] : kEntries) {
    const auto number = static_cast<std::uint16_t>(layout.entries.size());
    layout.entries.push_back({.bit_offset = at,
                              .bit_length = bits,
                              .type = type,
                              .node = 5,
                              .index = static_cast<std::uint16_t>(0x2000 + number),
                              .sub = 0,
                              .remote_pdo = 1,
                              .local_pdo = 1,
                              .name = "ram.Entry " + std::to_string(number)});
    at += bits;
  }
  layout.byte_size = (at + 7) / 8;
  return layout;
}

SetPlan plan_of(const Layout& layout) {
  linegate::named::Group group{"all", 1, {}};
  for (std::uint32_t i = 0; i < layout.entries.size(); ++i) {
    group.entries.push_back(i);
  }
  return SetPlan(linegate::named::group_types("a", layout, std::span(&group, 1)).types.at(0));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Layout layout = every_form();
  static const SetPlan plan = plan_of(layout);
  const std::span sample(reinterpret_cast<const std::byte*>(data), size);
  const auto key = linegate::named::key_of_set(sample);
  LINEGATE_EXPECT(!key || key->size <= key->octets.size());
  linegate::named::SetSample read;
  if (!plan.read(sample, read)) {
    return 0;
  }
  LINEGATE_EXPECT(key.has_value());
  LINEGATE_EXPECT(size <= plan.max_size());
  LINEGATE_EXPECT(read.gateway.size() <= kLongestText && read.line.size() <= kLongestText);
  LINEGATE_EXPECT(read.write.client.size() <= kLongestText);
  LINEGATE_EXPECT(read.write.values.size() <= layout.entries.size());
  LINEGATE_EXPECT(read.why.empty() == (read.refusal == linegate::line::OutputRefusal::none));
  for (const linegate::line::OutputValue& value : read.write.values) {
    const unsigned bits = layout.entries.at(value.entry).bit_length;
    LINEGATE_EXPECT(value.length == (bits + 7) / 8);
    for (unsigned bit = bits; bit < 8 * value.data.size(); ++bit) {
      LINEGATE_EXPECT((value.data[bit / 8] >> bit % 8 & std::byte{1}) == std::byte{0});
    }
  }
  return 0;
}
